"""Cuts the lists of a document that is no plan behind as many faulty entries as are told.

pydantic names all faults before anything else in the process goes on: a thousand items, each with every field of the
others, take it a second. One entry after another holds nobody up.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Annotated, Any, Final

from pydantic import Field, TypeAdapter, ValidationError

from app.domain.plan.geofence import FenceCircle, FencePolygon, RallyPoint
from app.domain.plan.items import PlanItem
from app.domain.plan.size_limits import MAX_FINDINGS

_ITEM: Final[TypeAdapter[Any]] = TypeAdapter(Annotated[PlanItem, Field(discriminator="type")])
_LISTS: Final[Mapping[str, TypeAdapter[Any]]] = {"items": _ITEM, "rally_points": TypeAdapter(RallyPoint)}
_FENCES: Final[Mapping[str, TypeAdapter[Any]]] = {
    "polygons": TypeAdapter(FencePolygon),
    "circles": TypeAdapter(FenceCircle),
}


def to_first_faulty(document: Mapping[str, Any]) -> dict[str, Any]:
    """The document itself if each of its lists has fewer than MAX_FINDINGS faults; else one that is no plan either."""
    cut = _with_cut(document, _LISTS)
    fence = cut.get("geofence")
    return {**cut, "geofence": _with_cut(fence, _FENCES)} if isinstance(fence, dict) else cut


def _with_cut(document: Mapping[str, Any], lists: Mapping[str, TypeAdapter[Any]]) -> dict[str, Any]:
    found = {name: document[name] for name in lists if isinstance(document.get(name), list)}
    return {**document, **{name: _cut(entries, lists[name]) for name, entries in found.items()}}


def _cut(entries: list[Any], kind: TypeAdapter[Any]) -> list[Any]:
    faults = 0
    for count, entry in enumerate(entries, start=1):
        try:
            kind.validate_json(json.dumps(entry))  # as JSON, like the whole: see parse_plan
        except ValidationError as error:
            faults += error.error_count()
            if faults >= MAX_FINDINGS:
                return entries[:count]
    return entries
