"""The hash of a mission says which lists were flown, on every machine alike."""

from __future__ import annotations

import math
import struct
from dataclasses import replace

import pytest

from app.domain.mission import MavCmd, MavFrame, Mission, MissionItem, MissionType, mission_hash

ITEM = MissionItem(0, MavFrame.GLOBAL_RELATIVE_ALT_INT, MavCmd.NAV_WAYPOINT, 5.0, 1.0, x=474000000, y=85000000, z=20.0)
VERTEX = MissionItem(0, MavFrame.GLOBAL, MavCmd.NAV_FENCE_CIRCLE_INCLUSION, 50.0, mission_type=MissionType.FENCE)
MISSION = Mission((ITEM, replace(ITEM, seq=1, x=474100000)), fence=(VERTEX,))


def test_the_same_lists_have_the_same_hash_whatever_made_them() -> None:
    other_nan = struct.unpack("<f", struct.pack("<I", 0xFFC00001))[0]
    same = replace(MISSION, items=(replace(ITEM, param3=other_nan, current=True), MISSION.items[1]))
    assert math.isnan(other_nan)
    assert mission_hash(same) == mission_hash(MISSION)
    assert mission_hash(MISSION) == "98693da976bf841f46bc6a69daca28dc1dc14c9ba8c446a207c283398d3f72bc"


@pytest.mark.parametrize(
    "change",
    [
        {"frame": MavFrame.GLOBAL_INT},
        {"command": MavCmd.NAV_LAND},
        {"param1": 0.0},
        {"param2": 2.0},
        {"param3": 0.0},
        {"param4": 90.0},
        {"x": 474000001},
        {"y": 85000001},
        {"z": 20.5},
        {"autocontinue": False},
    ],
)
def test_any_other_field_gives_another_hash(change: dict[str, object]) -> None:
    changed = replace(MISSION, items=(replace(ITEM, **change), MISSION.items[1]))  # type: ignore[arg-type]
    assert mission_hash(changed) != mission_hash(MISSION)


def test_order_and_place_of_items_count() -> None:
    first, second = MISSION.items
    others = (
        Mission((second, first), fence=MISSION.fence),
        Mission((first,), fence=(second, *MISSION.fence)),
        Mission((first, second), rally=MISSION.fence),
        Mission((first, second)),
    )
    assert len({mission_hash(mission) for mission in (MISSION, *others)}) == 5
