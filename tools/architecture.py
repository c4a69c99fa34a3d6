"""`make architecture`: the map of packages, made from the code's imports, and the picture of docs/architecture.md."""

from __future__ import annotations

import ast
import statistics
import sys
from collections.abc import Iterable, Mapping
from graphlib import TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "architecture.md"
PICTURE = ROOT / "docs" / "images" / "architecture.svg"
BEGIN, END = "<!-- made by `make architecture`: begin -->", "<!-- made by `make architecture`: end -->"
DEEP = ("domain", "services")
"""Layers that are shown folder by folder: the others are one package each."""

STEP_X, STEP_Y, BOX_X, BOX_Y = 128, 84, 112, 36
_HEAD = """\
<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" aria-label="Layers and their imports">
<style>
rect {{ fill: #eef2fb; stroke: #3f51b5 }}
path {{ fill: none; stroke: #5a6172; stroke-width: 1.3; marker-end: url(#head) }}
text {{ font: 14px sans-serif; text-anchor: middle; fill: #1b1f2a }}
</style>
<marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" markerHeight="8" orient="auto"><path \
d="M0,0 L8,4 L0,8 z" style="fill:#5a6172;stroke:none;marker-end:none"/></marker>
<rect width="{width}" height="{height}" style="fill:#fff;stroke:none"/>"""

ImportGraph = Mapping[str, frozenset[str]]


def modules(root: Path) -> dict[str, Path]:
    """The hand-written modules of app/ by their dotted names."""
    paths = (path for path in (root / "app").rglob("*.py") if "generated" not in path.parts)
    return {".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__"): path for path in paths}


def package_of(module: str) -> str:
    """`domain.plan` for `app.domain.plan.parse`, `storage` for `app.storage.events`."""
    parts = module.split(".")[1:]
    if not parts:
        return "app"
    deep = parts[0] in DEEP and len(parts) > 1
    return ".".join(parts[:2]) if deep else parts[0]


def import_graph(files: Mapping[str, Path]) -> ImportGraph:
    """Which package imports which."""
    graph: dict[str, set[str]] = {}
    for module, path in files.items():
        package = package_of(module)
        graph.setdefault(package, set())
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "app":
                names = [f"{node.module}.{alias.name}" for alias in node.names]
                targets = {name if name in files else node.module for name in names}
                graph[package] |= {package_of(target) for target in targets} - {package, "app"}
    return {package: frozenset(targets) for package, targets in sorted(graph.items())}


def import_cycles(graph: ImportGraph) -> list[tuple[str, ...]]:
    """Packages that can reach each other, each group once. Modules never do: tests/architecture holds that."""
    reach = {package: _reachable(package, graph) for package in graph}
    groups = {tuple(sorted(other for other in reach[package] if package in reach.get(other, ()))) for package in graph}
    return sorted(group for group in groups if len(group) > 1)


def _reachable(start: str, graph: ImportGraph) -> frozenset[str]:
    found: set[str] = set()
    todo = [start]
    while todo:
        new = graph.get(todo.pop(), frozenset()) - found
        found |= new
        todo.extend(new)
    return frozenset(found)


def layers(graph: ImportGraph) -> ImportGraph:
    """The same, layer by layer."""
    joined: dict[str, set[str]] = {}
    for package, targets in graph.items():
        layer = package.split(".")[0]
        joined.setdefault(layer, set()).update({target.split(".")[0] for target in targets} - {layer})
    return {layer: frozenset(targets) for layer, targets in sorted(joined.items())}


def rows(graph: ImportGraph) -> list[list[str]]:
    """The layers, each one row below all that import it."""
    depth: dict[str, int] = {}
    for layer in _importers_first(graph):
        depth[layer] = max((depth[other] + 1 for other, targets in graph.items() if layer in targets), default=0)
    return [sorted(layer for layer in depth if depth[layer] == row) for row in range(max(depth.values()) + 1)]


def _importers_first(graph: ImportGraph) -> list[str]:
    order = TopologicalSorter({layer: set[str]() for layer in graph})
    for layer, targets in graph.items():
        for target in targets:
            order.add(target, layer)
    return list(order.static_order())


def picture(graph: ImportGraph) -> str:
    """The layers as SVG. An arrow that follows from two others is left out."""
    joined = {layer: targets for layer, targets in layers(graph).items() if layer != "app"}
    placed = rows(joined)
    width = max(len(row) for row in placed) * STEP_X
    at = {
        layer: (width * (column + 0.5) / len(row), STEP_Y * (line + 0.5))
        for line, row in enumerate(placed)
        for column, layer in enumerate(row)
    }
    lines = [
        _arrow(at[layer], at[target])
        for layer, targets in joined.items()
        for target in sorted(targets)
        if not any(target in _reachable(other, joined) for other in targets - {target})
    ]
    boxes = [_box(layer, *place) for layer, place in sorted(at.items())]
    return "\n".join([_HEAD.format(width=width, height=STEP_Y * len(placed)), *lines, *boxes, "</svg>", ""])


def _arrow(start: tuple[float, float], end: tuple[float, float]) -> str:
    (x, y), (to_x, to_y) = (start[0], start[1] + BOX_Y / 2), (end[0], end[1] - BOX_Y / 2 - 3)
    bend = STEP_Y / 2
    return f'<path d="M{x:.0f},{y:.0f} C{x:.0f},{y + bend:.0f} {to_x:.0f},{to_y - bend:.0f} {to_x:.0f},{to_y:.0f}"/>'


def _box(layer: str, x: float, y: float) -> str:
    corner = f'x="{x - BOX_X / 2:.0f}" y="{y - BOX_Y / 2:.0f}"'
    text = f'<text x="{x:.0f}" y="{y + 5:.0f}">{layer}</text>'
    return f'<rect {corner} width="{BOX_X}" height="{BOX_Y}" rx="4"/>{text}'


def table(files: Mapping[str, Path], graph: ImportGraph) -> str:
    """A row for each package: its files, its lines, what it imports."""
    rows = ["| package | files | lines | imports |", "|---|---|---|---|"]
    for package, targets in graph.items():
        sizes = _sizes(path for module, path in files.items() if package_of(module) == package)
        rows.append(f"| `{package}` | {len(sizes)} | {sum(sizes)} | {', '.join(sorted(targets)) or '-'} |")
    return "\n".join(rows)


def drawn(files: Mapping[str, Path], graph: ImportGraph) -> str:
    """What stands between the marks of the page. Without lines and files: they change with every commit."""
    groups = "\n".join(f"- {', '.join(f'`{package}`' for package in group)}" for group in import_cycles(graph))
    packages = "\n".join(f"| `{package}` | {', '.join(sorted(to)) or '-'} |" for package, to in graph.items())
    imports = f"| package | imports |\n|---|---|\n{packages}"
    reaching = f"Packages that reach each other:\n\n{groups or '- none'}"
    image = f"![The layers of app/ and what they import](images/{PICTURE.name})"
    caption = "An arrow that follows from two others is left out. The table has all of them, folder by folder."
    return "\n\n".join((BEGIN, image, caption, imports, reaching, END))


def redrawn(page: str, block: str) -> str:
    """The page with the block between its marks."""
    before, rest = page.split(BEGIN)
    return before + block + rest.split(END)[1]


def _sizes(paths: Iterable[Path]) -> list[int]:
    return [path.read_text(encoding="utf-8").count("\n") for path in paths]


def main() -> None:
    """Print the map, and draw the page anew."""
    files = modules(ROOT)
    graph = import_graph(files)
    sizes = _sizes(files.values())
    write = sys.stdout.write
    write(f"{table(files, graph)}\n\n")
    write("".join(f"import cycle: {', '.join(group)}\n" for group in import_cycles(graph)) or "no import cycle\n")
    write(f"{len(sizes)} files, {sum(sizes)} lines, median {statistics.median(sizes):g}, longest {max(sizes)}\n")
    PICTURE.write_text(picture(graph), encoding="utf-8")
    PAGE.write_text(redrawn(PAGE.read_text(encoding="utf-8"), drawn(files, graph)), encoding="utf-8")


if __name__ == "__main__":
    main()
