"""A plan item is described in its own file: who needs to know what an item is asks it."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from app.domain.items import ITEM_TYPES, Drop, Item, Stop
from tests.architecture.sources import Source

FOLDER = "app/domain/items/"
PHOTO: Final = re.compile(
    r"\b(Photo|photo item|Camera|Picture|CAMERA_IMAGE_CAPTURED)\b"  # its classes and its message
    r"|\b(drop|self|now|before)\.pictures?\b|^    pictures?: "  # the evidence
)
"""What the code says of the item `photo`, its simulated camera and its evidence.

The command IMAGE_START_CAPTURE alone is MAVLink's: other formats and PX4's navigator know it without that item.
"""
TOUCHED_BY_PHOTO: Final = frozenset(
    {
        "app/domain/items/photo.py",
        "app/domain/items/__init__.py",  # the list
        "app/simulator/external/others.py",  # the simulated camera
        "app/simulator/dialect/waydrop.xml",  # its message
        "app/vehicles/decoders.py",  # the message read
        "app/domain/vehicle/state.py",  # the newest picture
        "app/domain/drop/record.py",  # the pictures of a drop
        "app/api/delivery_report_page/page.py",  # said in the delivery report
    }
)
KINDS = frozenset(kind.__name__ for kind in (*ITEM_TYPES, Drop, Item, Stop))


def ladders(sources: Iterable[Source]) -> list[str]:
    """Code that goes through item types one by one: a match on them, or an isinstance over several.

    A rule about one type may look for that type.
    """
    return [
        f"{source.at(node)}: {what}; ask the item (app/domain/items/base.py)"
        for source in sources
        if source.path.startswith("app/") and not source.path.startswith(FOLDER) and _knows_items(source)
        for node, what in _steps(source)
    ]


def touched_by_photo(texts: Mapping[str, str]) -> frozenset[str]:
    """The hand-written files that the item `photo` touches outside tests and docs."""
    return frozenset(path for path, text in texts.items() if any(_about_photo(line) for line in text.splitlines()))


def _about_photo(line: str) -> bool:
    """People attach photos too: a word of prose about these counts as none."""
    return PHOTO.search(line) is not None and "attach" not in line.lower()


def _knows_items(source: Source) -> bool:
    """Other things have these names too: the tasks of offboard control."""
    return any(
        isinstance(node, ast.ImportFrom) and node.module in ("app.domain.items", "app.domain.plan")
        for node in source.nodes
    )


def _steps(source: Source) -> Iterator[tuple[ast.AST, str]]:
    for node in source.nodes:
        if isinstance(node, ast.MatchClass) and _name(node.cls) in KINDS:
            yield node, f"match on {_name(node.cls)}"
        if isinstance(node, ast.Call) and _name(node.func) == "isinstance" and len(node.args) == 2:
            kinds = [name for part in ast.walk(node.args[1]) if (name := _name(part)) in KINDS]
            if len(kinds) > 1:
                yield node, f"isinstance over {', '.join(kinds)}"


def _name(node: ast.AST) -> str:
    return node.id if isinstance(node, ast.Name) else ""
