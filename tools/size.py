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
}
"""Parts of app/ that came after the redesign and are none of it, by their paths. What they added elsewhere counts as no
feature.
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


def _layer(path: str) -> str:
    return path.split("/")[0].removesuffix(".py")


def shape_table(before: Shape, after: Shape) -> str:
    """The measures of both commits side by side as Markdown."""
    rows = ((label, getattr(before, name), getattr(after, name)) for name, label in LABELS.items())
    return _markdown(f"| {label} | {old:,} | {new:,} |" for label, old, new in rows)


def table(before: Mapping[str, int], after: Mapping[str, int]) -> str:
    """Both commits side by side as Markdown: layers, features, and what is left without these."""
    layers, features = (by_layer(before), by_layer(after)), (by_feature(before), by_feature(after))
    lines = [
        f"| `{layer}` | {layers[0][layer]:,} | {layers[1][layer]:,} |" for layer in sorted({*layers[0], *layers[1]})
    ]
    lines += [f"| feature: {name} | {features[0][name]:,} | {features[1][name]:,} |" for name in FEATURES]
    whole = layers[0].total(), layers[1].total()
    lines.append(f"| **all** | {whole[0]:,} | {whole[1]:,} |")
    lines.append(
        f"| **without these features** | {whole[0] - features[0].total():,} | {whole[1] - features[1].total():,} |"
    )
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
    sys.stdout.write(f"{shapes}\n\n{table(sizes_of(before), sizes_of(after))}\n")


if __name__ == "__main__":
    main()
