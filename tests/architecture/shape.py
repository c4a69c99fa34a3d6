"""How large files and functions may be, what they may be called, and what they must not contain."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Mapping
from pathlib import PurePath

from tests.architecture.sources import Source

MAX_FILE_LINES = 500
MAX_FUNCTION_LINES = 49
MAX_CONSTRUCTOR_PARAMETERS = 8
VAGUE_FILE = re.compile(r"^(utils?|helpers?|common|misc|managers?|\w+_(utils?|helpers?|managers?))$")
VAGUE_CLASS = re.compile(r"(Manager|Helper|Utils?)$")
FIXED_PATH = re.compile(r"^/(tmp|work|root|home|opt|srv|mnt|Users)/")
ADDRESS = re.compile(
    r"""--(extra-)?index-url|--find-links|"resolved"\s*:|registry\s*=\s*http|https?://[^\s"]*(pypi|npmjs)\.""",
    re.IGNORECASE,
)


def long_files(texts: Mapping[str, str]) -> list[str]:
    """Files with more lines than one job needs."""
    counts = {path: text.count("\n") + (not text.endswith("\n")) for path, text in texts.items() if text}
    return [
        f"{path}:{lines}: {lines} lines, at most {MAX_FILE_LINES}; a file has one job"
        for path, lines in counts.items()
        if lines > MAX_FILE_LINES
    ]


def long_functions(sources: Iterable[Source]) -> list[str]:
    """Functions of 50 lines or more, docstring included."""
    found = []
    for source in sources:
        for node in source.nodes:
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                lines = (node.end_lineno or node.lineno) - node.lineno + 1
                if lines > MAX_FUNCTION_LINES:
                    found.append(f"{source.at(node)}: {node.name} has {lines} lines, at most {MAX_FUNCTION_LINES}")
    return found


def wide_constructors(sources: Iterable[Source]) -> list[str]:
    """Constructors that take more than eight things: the class does more than one job."""
    found = []
    for source in sources:
        for node in source.nodes:
            if isinstance(node, ast.FunctionDef) and node.name == "__init__":
                count = len(node.args.posonlyargs) + len(node.args.args) + len(node.args.kwonlyargs) - 1
                if count > MAX_CONSTRUCTOR_PARAMETERS:
                    most = MAX_CONSTRUCTOR_PARAMETERS
                    found.append(f"{source.at(node)}: a constructor with {count} parameters, at most {most}")
    return found


def double_class_names(sources: Iterable[Source]) -> list[str]:
    """Public classes that share their name with another one of the same layer."""
    places: dict[tuple[str, str], list[str]] = {}
    for source in sources:
        for node in source.tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places.setdefault((source.layer, node.name), []).append(source.at(node))
    return [
        f"{at[0]}: class {name} is also at {', '.join(at[1:])}; one name, one thing in a layer"
        for (_, name), at in sorted(places.items())
        if len(at) > 1
    ]


def vague_names(sources: Iterable[Source]) -> list[str]:
    """Files and classes whose name says nothing about their job."""
    found = []
    for source in sources:
        stem = PurePath(source.path).stem
        if VAGUE_FILE.match(stem):
            found.append(f"{source.path}:1: a file named {stem} has no job; name the job")
        for node in source.nodes:
            if isinstance(node, ast.ClassDef) and VAGUE_CLASS.search(node.name):
                found.append(f"{source.at(node)}: class {node.name}; name what it does")
    return found


def prints(sources: Iterable[Source]) -> list[str]:
    """Calls of print: the cli speaks through rich, all else through the log."""
    return [
        f"{source.at(node)}: print"
        for source in sources
        for node in source.nodes
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "print"
    ]


def blind_excepts(sources: Iterable[Source]) -> list[str]:
    """Handlers that catch everything. BaseException is allowed only where the handler ends by raising it again."""
    found = []
    for source in sources:
        for node in source.nodes:
            if not isinstance(node, ast.ExceptHandler):
                continue
            names = [] if node.type is None else [ast.unparse(part) for part in _parts(node.type)]
            raises_again = isinstance(node.body[-1], ast.Raise) and node.body[-1].exc is None
            if node.type is None or "Exception" in names or ("BaseException" in names and not raises_again):
                found.append(f"{source.at(node)}: catches everything; name the errors that are expected")
    return found


def _parts(node: ast.expr) -> list[ast.expr]:
    return list(node.elts) if isinstance(node, ast.Tuple) else [node]


def unbounded_queues(sources: Iterable[Source]) -> list[str]:
    """Queues without a bound: a slow reader would fill the memory."""
    found = []
    for source in sources:
        for node in source.nodes:
            if not isinstance(node, ast.Call):
                continue
            name = ast.unparse(node.func).split(".")[-1].split("[")[0]
            bound = [*node.args[:1], *(word.value for word in node.keywords if word.arg == "maxsize")]
            no_bound = not bound or (isinstance(bound[0], ast.Constant) and bound[0].value == 0)
            if name == "SimpleQueue" or (name in {"Queue", "PriorityQueue", "LifoQueue"} and no_bound):
                found.append(f"{source.at(node)}: a {name} without a bound")
    return found


def fixed_paths(sources: Iterable[Source]) -> list[str]:
    """Paths of one particular machine in strings."""
    return [
        f"{source.at(node)}: the fixed path {node.value!r}; make it a setting"
        for source in sources
        for node in source.nodes
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and FIXED_PATH.match(node.value)
    ]


def addresses(texts: Mapping[str, str]) -> list[str]:
    """Download addresses in build and lock files: where packages come from is the environment's choice."""
    return [
        f"{path}:{number}: names a download address"
        for path, text in texts.items()
        for number, line in enumerate(text.splitlines(), start=1)
        if ADDRESS.search(line)
    ]


def unpinned(texts: Mapping[str, str]) -> list[str]:
    """Requirements of a lock file without an exact version or without a hash."""
    found = []
    for path, text in texts.items():
        joined = text.replace("\\\n", " ")
        for line in joined.splitlines():
            entry = line.strip()
            if entry and not entry.startswith(("#", "-")) and ("==" not in entry or "--hash=sha256:" not in entry):
                found.append(f"{path}:1: {entry.split()[0]} is not pinned by version and hash")
    return found
