"""Fence items: what PX4 refuses at once, and what it forgets when storing."""

from __future__ import annotations

from dataclasses import replace

from app.simulator.mission.item import Item
from app.simulator.wire import MissionAck

POLYGON_INCLUSION = 5001
POLYGON_EXCLUSION = 5002
CIRCLE_INCLUSION = 5003
CIRCLE_EXCLUSION = 5004
STORED_FRAME = 5


def fence_refusal(item: Item) -> MissionAck:
    """A polygon of less than 3 vertices is an error; a wrong number of items is not noticed [05_fence_rally]."""
    if item.command in (POLYGON_INCLUSION, POLYGON_EXCLUSION) and item.param1 < 3:
        return MissionAck.ERROR
    return MissionAck.ACCEPTED


def stored_fence_item(item: Item) -> Item:
    """A fence is stored without frame and autocontinue: a download shows GLOBAL_INT and 0."""
    return replace(item, frame=STORED_FRAME, autocontinue=0, param2=0.0, param3=0.0, param4=0.0, z=0.0)
