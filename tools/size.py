"""Sizes and shapes of app/ at two commits, by layer and by new features: `python -m tools.size --base REV`."""

from __future__ import annotations

import argparse
import ast
import io
import json
import subprocess
import sys
import tarfile
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from tools.architecture import ROOT

BEFORE_REDESIGN = "b15dbb79"
FEATURES: Mapping[str, tuple[str, ...]] = {
    "guards and keys of vehicle links": (
        *("vehicles/link_guard/", "services/vehicle_links.py", "domain/vehicle/link_security.py"),
        *("domain/ports/link_keys.py", "cli/link_key.py", "simulator/signing.py", "vehicles/steadiness.py"),
    ),
    "cluster": (
        *("cluster/", "domain/cluster/", "storage/postgres/", "storage/relay.py", "services/relay.py"),
        *("services/projection.py", "services/remote/", "cluster_application.py", "cli/cluster.py", "api/gateways.py"),
        *("services/site_lease.py", "services/handover.py", "api/site.py"),
    ),
    "audit log": ("services/audit.py", "domain/audit.py", "api/audit.py", "cli/audit.py", "storage/refusals.py"),
    "TLS, proxies, limits of connections": (
        *("api/tls.py", "api/proxies.py", "api/connections.py", "services/attempts.py", "file_limit.py"),
    ),
    "watches of the event loop": ("services/loop_watch.py", "services/hang_watch.py"),
    "private files and secrets": ("storage/private.py",),
    "photo": ("domain/items/photo.py", "simulator/external/others.py"),
    "stored inputs and replay": ("domain/flight/recording.py",),
    "retention": ("services/retention.py", "storage/retention.py"),
    "plan checks in a process of their own": (
        *("services/worker_process.py", "services/worker_main.py", "services/plan_work.py"),
    ),
}
"""Parts of app/ that came after the redesign and are none of it, by their paths."""
FEATURE_COMMITS: Mapping[str, tuple[str, ...]] = {
    "flights as newer PX4 flies them": ("3b3adabf", "b66f3577", "2933734e", "9cae8362", "06bffc0d", "511452fd"),
    "replay, photo": ("249e4afd", "782b6f30"),
    "forged and doubted messages of a link": (
        *("e5ad0c79", "139da1fa", "a587a2fc", "ba8995da", "a4e8fc30", "985db10f"),
    ),
    "hostile requests, tokens, audit, private files": (
        *("82390a6a", "14a1a2e8", "fde28e5d", "566240ee", "0c98c799", "5064e134", "fb303a34", "59e78f08"),
        *("be18e1a4", "f4e82bbc", "779ec006", "4fc68aa9", "ba353fe9"),
    ),
    "cluster": (
        *("22fcc942", "13b77c4d", "bb32c057", "ca0f7918", "a73f2154", "cd76e4a5", "90eda8ff", "ce14f491"),
        *("2e91ab52", "de8c1699", "712cb515", "326aa970", "068f99c4", "c169e123"),
    ),
    "speed, watches of the event loop": (
        *("beb0b0a2", "a4c64353", "f6c0c7bd", "96b1fc48", "99f89404", "caae241d", "9df9b30a", "554b71a1"),
        *("0a43bb06", "d259f389", "96b978ce"),
    ),
    "retention": ("8979ddd5", "90cc0f99", "ad9b7bcd", "82dbe709", "7be1c2d0", "3c3e09c2"),
    "order of jobs": ("3a9d3924", "935f1888"),
    "maps of the page": ("cfe5a993",),
}
"""Commits after the redesign that belong to a feature: what they added to other files than those of FEATURES, less what
they removed, counts as the feature's. Whatever is not named here counts as the redesign's.
"""


@dataclass(frozen=True, slots=True)
class Shape:
    """The measures of decision 29. A class name counts as double if a layer has two public classes of this name."""

    files: int
    lines: int
    median_lines: int
    single_importers: int
    double_class_names: int
    complex_functions: int
    wide_constructors: int


LABELS: Mapping[str, str] = {
    "files": "files",
    "lines": "lines",
    "median_lines": "median lines of a file",
    "single_importers": "files with exactly one importer",
    "double_class_names": "public class names twice in a layer",
    "complex_functions": "functions over complexity 12 (C901)",
    "wide_constructors": "constructors with more than 8 parameters",
}


def sources_at(revision: str) -> dict[str, str]:
    """The text of each hand-written module of app/ at a commit, by its path below app/."""
    archive = _run("git", "archive", "--format=tar", revision, "app")
    sources: dict[str, str] = {}
    with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
        for member in tar:
            path = member.name.removeprefix("app/")
            if path.endswith(".py") and "generated" not in path.split("/") and (file := tar.extractfile(member)):
                sources[path] = file.read().decode()
    return sources


def sizes_of(sources: Mapping[str, str]) -> dict[str, int]:
    """The lines of each module."""
    return {path: text.count("\n") for path, text in sources.items()}


def shape_of(sources: Mapping[str, str]) -> Shape:
    """Measure the modules of one commit. Empty modules count as no file."""
    trees = {path: ast.parse(text) for path, text in sources.items() if text}
    lines = sizes_of({path: sources[path] for path in trees})
    return Shape(
        files=len(trees),
        lines=sum(lines.values()),
        median_lines=round(median(lines.values())),
        single_importers=sum(len(importers) == 1 for importers in _importers(trees).values()),
        double_class_names=sum(count > 1 for count in _public_classes(trees).values()),
        complex_functions=_complex_functions(sources),
        wide_constructors=sum(_is_wide_constructor(node) for tree in trees.values() for node in ast.walk(tree)),
    )


def _importers(trees: Mapping[str, ast.Module]) -> dict[str, set[str]]:
    """The paths of the modules that import each module."""
    paths = {_module(path): path for path in trees}
    importers: defaultdict[str, set[str]] = defaultdict(set)
    for path, tree in trees.items():
        for name in _imported(tree):
            if (target := paths.get(name)) is not None and target != path:
                importers[target].add(path)
    return importers


def _module(path: str) -> str:
    return ".".join(Path("app", path).with_suffix("").parts).removesuffix(".__init__")


def _imported(tree: ast.Module) -> Iterator[str]:
    """The dotted names that a module imports, whether modules or what is in them."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module is not None:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def _public_classes(trees: Mapping[str, ast.Module]) -> Counter[tuple[str, str]]:
    """How often each layer has a public class of a name."""
    return Counter(
        (_layer(path), node.name)
        for path, tree in trees.items()
        for node in tree.body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )


def _is_wide_constructor(node: ast.AST) -> bool:
    if not (isinstance(node, ast.FunctionDef) and node.name == "__init__"):
        return False
    return len([*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]) - 1 > 8


def _complex_functions(sources: Mapping[str, str]) -> int:
    """Count by ruff, with none of the project's exceptions."""
    with tempfile.TemporaryDirectory() as folder:
        for path, text in sources.items():
            file = Path(folder, path)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")
        options = ("--isolated", "--no-cache", "--exit-zero", "--ignore-noqa", "--select=C901", "--output-format=json")
        limit = "lint.mccabe.max-complexity=12"
        found = _run(sys.executable, "-m", "ruff", "check", *options, "--config", limit, folder)
    return len(json.loads(found))


def by_layer(sizes: Mapping[str, int]) -> Counter[str]:
    """The lines of each layer: a folder of app/, or a file right in it."""
    layers: Counter[str] = Counter()
    for path, lines in sizes.items():
        layers[_layer(path)] += lines
    return layers


def by_feature(sizes: Mapping[str, int]) -> Counter[str]:
    """The lines of each feature."""
    return Counter(
        {name: sum(n for path, n in sizes.items() if path.startswith(parts)) for name, parts in FEATURES.items()}
    )


def added_by_commits(base: str, at: str) -> Counter[str]:
    """The lines that the commits of each feature between `base` and `at` added to files that are no feature's."""
    added: Counter[str] = Counter()
    between = _run("git", "rev-list", f"{base}..{at}").decode().split()
    for name, commits in FEATURE_COMMITS.items():
        if found := [commit for commit in between if commit.startswith(commits)]:
            show = ("git", "show", "--no-renames", "--numstat", "--format=", *found, "--", "app/*.py")
            added[name] = added_elsewhere(_run(*show).decode())
    return added


def added_elsewhere(numstat: str) -> int:
    """Lines added less lines removed, by `git show --numstat`, in hand-written files that are no feature's."""
    features = tuple(f"app/{path}" for parts in FEATURES.values() for path in parts)
    rows = (row.split("\t") for row in numstat.splitlines() if row)
    return sum(
        int(plus) - int(minus)
        for plus, minus, path in rows
        if not path.startswith(features) and "generated" not in path.split("/")
    )


def _layer(path: str) -> str:
    return path.split("/")[0].removesuffix(".py")


def shape_table(before: Shape, after: Shape) -> str:
    """The measures of both commits side by side as Markdown."""
    rows = ((label, getattr(before, name), getattr(after, name)) for name, label in LABELS.items())
    return _markdown(f"| {label} | {old:,} | {new:,} |" for label, old, new in rows)


def table(before: Mapping[str, int], after: Mapping[str, int], added: Mapping[str, int]) -> str:
    """Both commits side by side as Markdown: layers, features, and what is left without these.

    `added`: what features added to files of others.
    """
    layers, features = (by_layer(before), by_layer(after)), (by_feature(before), by_feature(after))
    lines = [
        f"| `{layer}` | {layers[0][layer]:,} | {layers[1][layer]:,} |" for layer in sorted({*layers[0], *layers[1]})
    ]
    lines += [f"| feature: {name} | {features[0][name]:,} | {features[1][name]:,} |" for name in FEATURES]
    lines += [f"| in files of others: {name} | 0 | {count:,} |" for name, count in added.items()]
    whole = layers[0].total(), layers[1].total()
    left = whole[0] - features[0].total(), whole[1] - features[1].total() - sum(added.values())
    lines.append(f"| **all** | {whole[0]:,} | {whole[1]:,} |")
    lines.append(f"| **without these features** | {left[0]:,} | {left[1]:,} |")
    return _markdown(lines)


def _markdown(rows: Iterable[str]) -> str:
    return "\n".join(("| | before | after |", "|---|---|---|", *rows))


def _run(*command: str) -> bytes:
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True).stdout


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--base", default=BEFORE_REDESIGN, help="the commit before (default: before the redesign)")
    parser.add_argument("--at", default="HEAD", help="the commit after (default: HEAD)")
    given = parser.parse_args()
    before, after = sources_at(given.base), sources_at(given.at)
    shapes = shape_table(shape_of(before), shape_of(after))
    sys.stdout.write(
        f"{shapes}\n\n{table(sizes_of(before), sizes_of(after), added_by_commits(given.base, given.at))}\n"
    )


if __name__ == "__main__":
    main()
