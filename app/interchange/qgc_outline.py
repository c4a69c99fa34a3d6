"""How much a .plan may hold. Asked before anything of it is copied or read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from app.domain.plan.json_tree import MAX_ITEMS, MAX_POLYGONS, MAX_RALLY_POINTS, MAX_VERTICES
from app.domain.validation.finding import Finding, Severity, json_pointer

MAX_FILE_ITEMS: Final = 4 * MAX_ITEMS
"""A drop or a landing that Waydrop writes is three items, a waypoint with a speed two."""
_LISTS: Final = (
    ("mission", "items", MAX_FILE_ITEMS, f"items; a plan has at most {MAX_ITEMS}"),
    ("geoFence", "polygons", MAX_POLYGONS, f"polygons; a plan has at most {MAX_POLYGONS}"),
    ("geoFence", "circles", MAX_POLYGONS, f"circles; a plan has at most {MAX_POLYGONS}"),
    ("rallyPoints", "points", MAX_RALLY_POINTS, f"rally points; a plan has at most {MAX_RALLY_POINTS}"),
)


def long_lists_of_qgc(document: Mapping[str, Any]) -> list[Finding]:
    """The lists of a file that are longer than any plan's. `document` is what a JSON reader returned, unchecked."""
    found = [
        _too_large(json_pointer(part, name), f"{len(entries)} {what}")
        for part, name, most, what in _LISTS
        if len(entries := _list(document.get(part), name)) > most
    ]
    return found or [
        _too_large(json_pointer("geoFence", "polygons", index, "polygon"), message)
        for index, message in _long_polygons(document.get("geoFence"))
    ]


def _long_polygons(fence: object) -> Iterator[tuple[int, str]]:
    for index, polygon in enumerate(_list(fence, "polygons")):
        if (count := len(_list(polygon, "polygon"))) > MAX_VERTICES:
            yield index, f"{count} vertices; a polygon has at most {MAX_VERTICES}"


def _list(part: object, name: str) -> list[Any]:
    """Empty if it is none: the readers say so."""
    entries = part.get(name) if isinstance(part, Mapping) else None
    return entries if isinstance(entries, list) else []


def _too_large(pointer: str, message: str) -> Finding:
    return Finding(code="conversion.too_large", severity=Severity.ERROR, pointer=pointer, message=message)
