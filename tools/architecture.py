"""`make architecture`: the map of rooms, made from the code's own imports, and the picture of docs/architecture.md."""

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
"""Layers that are shown folder by folder: the others are one room each."""

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

Arrows = Mapping[str, frozenset[str]]


def modules(root: Path) -> dict[str, Path]:
    """The hand-written modules of app/ by their dotted names."""
    paths = (path for path in (root / "app").rglob("*.py") if "generated" not in path.parts)
    return {".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__"): path for path in paths}


def room_of(module: str) -> str:
    """`domain.plan` for `app.domain.plan.parse`, `storage` for `app.storage.events`."""
    parts = module.split(".")[1:]
    if not parts:
        return "app"
    deep = parts[0] in DEEP and len(parts) > 1
    return ".".join(parts[:2]) if deep else parts[0]


def arrows_between(files: Mapping[str, Path]) -> Arrows:
    """Which room imports which."""
    arrows: dict[str, set[str]] = {}
    for module, path in files.items():
        room = room_of(module)
        arrows.setdefault(room, set())
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "app":
                names = [f"{node.module}.{alias.name}" for alias in node.names]
                targets = {name if name in files else node.module for name in names}
                arrows[room] |= {room_of(target) for target in targets} - {room, "app"}
    return {room: frozenset(targets) for room, targets in sorted(arrows.items())}


def circles(arrows: Arrows) -> list[tuple[str, ...]]:
    """Rooms that can reach each other, each group once. Modules never do: tests/architecture holds that."""
    reach = {room: _reachable(room, arrows) for room in arrows}
    groups = {tuple(sorted(other for other in reach[room] if room in reach.get(other, ()))) for room in arrows}
    return sorted(group for group in groups if len(group) > 1)


def _reachable(start: str, arrows: Arrows) -> frozenset[str]:
    found: set[str] = set()
    todo = [start]
    while todo:
        new = arrows.get(todo.pop(), frozenset()) - found
        found |= new
        todo.extend(new)
    return frozenset(found)


def layers(arrows: Arrows) -> Arrows:
    """The same, layer by layer."""
    joined: dict[str, set[str]] = {}
    for room, targets in arrows.items():
        layer = room.split(".")[0]
        joined.setdefault(layer, set()).update({target.split(".")[0] for target in targets} - {layer})
    return {layer: frozenset(targets) for layer, targets in sorted(joined.items())}


def rows(arrows: Arrows) -> list[list[str]]:
    """The layers, each one row below all that import it."""
    depth: dict[str, int] = {}
    for layer in _importers_first(arrows):
        depth[layer] = max((depth[other] + 1 for other, targets in arrows.items() if layer in targets), default=0)
    return [sorted(layer for layer in depth if depth[layer] == row) for row in range(max(depth.values()) + 1)]


def _importers_first(arrows: Arrows) -> list[str]:
    order = TopologicalSorter({layer: set[str]() for layer in arrows})
    for layer, targets in arrows.items():
        for target in targets:
            order.add(target, layer)
    return list(order.static_order())


def picture(arrows: Arrows) -> str:
    """The layers as SVG. An arrow that follows from two others is left out."""
    joined = {layer: targets for layer, targets in layers(arrows).items() if layer != "app"}
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


def table(files: Mapping[str, Path], arrows: Arrows) -> str:
    """A row for each room: its files, its lines, what it imports."""
    rows = ["| room | files | lines | imports |", "|---|---|---|---|"]
    for room, targets in arrows.items():
        sizes = _sizes(path for module, path in files.items() if room_of(module) == room)
        rows.append(f"| `{room}` | {len(sizes)} | {sum(sizes)} | {', '.join(sorted(targets)) or '-'} |")
    return "\n".join(rows)


def drawn(files: Mapping[str, Path], arrows: Arrows) -> str:
    """What stands between the marks of the page. Without lines and files: they change with every commit."""
    groups = "\n".join(f"- {', '.join(f'`{room}`' for room in group)}" for group in circles(arrows))
    rooms = "\n".join(f"| `{room}` | {', '.join(sorted(to)) or '-'} |" for room, to in arrows.items())
    imports = f"| room | imports |\n|---|---|\n{rooms}"
    reaching = f"Rooms that reach each other:\n\n{groups or '- none'}"
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
    arrows = arrows_between(files)
    sizes = _sizes(files.values())
    write = sys.stdout.write
    write(f"{table(files, arrows)}\n\n")
    write("".join(f"circle of rooms: {', '.join(group)}\n" for group in circles(arrows)) or "no circle of rooms\n")
    write(f"{len(sizes)} files, {sum(sizes)} lines, median {statistics.median(sizes):g}, longest {max(sizes)}\n")
    PICTURE.write_text(picture(arrows), encoding="utf-8")
    PAGE.write_text(redrawn(PAGE.read_text(encoding="utf-8"), drawn(files, arrows)), encoding="utf-8")


if __name__ == "__main__":
    main()
