"""The hand-made files, and what a .plan means: its mission items without what is only for people or for us."""

from __future__ import annotations

import json
from typing import Any

from app.domain.items import FORMS
from app.interchange.findings import Report
from app.interchange.item_draft import ABSOLUTE, RELATIVE, FileItem
from app.interchange.qgc_reader import read_qgc_items
from tests.support.paths import DATA

FOLDER = DATA / "interchange"
DO_JUMP, TAKEOFF = 177, 22
Json = dict[str, Any]


def raw(name: str) -> bytes:
    return (FOLDER / name).read_bytes()


def document(name: str) -> Json:
    made: Json = json.loads(raw(name))
    return made


def meaning(plan: Json) -> Json:
    """What a vehicle gets from a .plan: items, fence, rally points, home."""
    mission = plan["mission"]
    items = read_qgc_items(mission["items"], "", None, Report())
    places = {float(item.number): index for index, item in enumerate(items)}
    return {
        "items": [_item(item, places) for item in items],
        "fence": plan["geoFence"],
        "rally": plan["rallyPoints"]["points"],
        "home": mission["plannedHomePosition"],
    }


def _item(item: FileItem, places: dict[float, int]) -> tuple[Any, ...]:
    """Parameters that a command does not use are nothing; so is a 0 that means "the vehicle's own"."""
    params: list[Any] = list(item.params)
    form = FORMS.get(item.command)
    if form is not None:
        free = {param.number for param in form.params.values() if param.zero_is_none}
        used = form.used()
        params = [
            None if index not in used or (index in free and value == 0) else value
            for index, value in enumerate(params, start=1)
        ]
    if item.command == TAKEOFF:
        params[0] = params[0] or None  # no pitch
    if item.command == DO_JUMP:
        params[0] = places[params[0]]
    reference = "home" if item.frame in RELATIVE else "sea" if item.frame in ABSOLUTE else ""
    return (item.command, reference, tuple(params))
