"""`make architecture`: the map of rooms, made from the code's own imports, and the picture of docs/architecture.md."""

from __future__ import annotations

import ast
import statistics
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "architecture.md"
BEGIN, END = "<!-- made by `make architecture`: begin -->", "<!-- made by `make architecture`: end -->"
DEEP = ("domain", "services")
"""Layers that are shown folder by folder: the others are one room each."""

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


def picture(arrows: Arrows) -> str:
    """The layers as a Mermaid diagram."""
    lines = [f"  {layer} --> {target}" for layer, targets in layers(arrows).items() for target in sorted(targets)]
    return "\n".join(["```mermaid", "flowchart TD", *lines, "```"])


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
    return "\n\n".join((BEGIN, picture(arrows), imports, reaching, END))


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
    PAGE.write_text(redrawn(PAGE.read_text(encoding="utf-8"), drawn(files, arrows)), encoding="utf-8")


if __name__ == "__main__":
    main()
