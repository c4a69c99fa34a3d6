"""Validates the entries of a document's lists, one after another, up to as many faults as are told.

pydantic names all faults before anything else in the process goes on: a thousand items, each with every field of the
others, take it a second. One entry after another holds nobody up.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final

from pydantic import Field, TypeAdapter, ValidationError

from app.domain.items import PlanItem
from app.domain.plan.geofence import FenceCircle, FencePolygon, RallyPoint
from app.domain.plan.size_limits import MAX_FINDINGS

_ITEM: Final[TypeAdapter[Any]] = TypeAdapter(Annotated[PlanItem, Field(discriminator="type")])
_LISTS: Final[Mapping[str, TypeAdapter[Any]]] = {"items": _ITEM, "rally_points": TypeAdapter(RallyPoint)}
_FENCES: Final[Mapping[str, TypeAdapter[Any]]] = {
    "polygons": TypeAdapter(FencePolygon),
    "circles": TypeAdapter(FenceCircle),
}


def with_entries(document: Mapping[str, Any]) -> dict[str, Any]:
    """The document with each valid entry as its model, so that nothing is validated twice.

    A list ends behind the entry that brings its faults to MAX_FINDINGS: it is no plan either.
    """
    made = _with_lists(document, _LISTS)
    fence = made.get("geofence")
    return {**made, "geofence": _with_lists(fence, _FENCES)} if isinstance(fence, dict) else made


def _with_lists(document: Mapping[str, Any], lists: Mapping[str, TypeAdapter[Any]]) -> dict[str, Any]:
    found = {name: document[name] for name in lists if isinstance(document.get(name), list)}
    return {**document, **{name: _validated(entries, lists[name]) for name, entries in found.items()}}


def _validated(entries: list[Any], kind: TypeAdapter[Any]) -> list[Any]:
    made: list[Any] = []
    faults = 0
    for entry in entries:
        try:
            made.append(kind.validate_python(entry))
        except ValidationError as error:
            made.append(entry)
            faults += error.error_count()
            if faults >= MAX_FINDINGS:
                break
    return made
