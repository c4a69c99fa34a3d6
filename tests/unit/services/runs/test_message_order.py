"""A run's record is of what the vehicle did, and not of the order in which its messages are handled."""

from __future__ import annotations

from typing import Any

from app.domain.ports import ItemReached
from app.domain.run import RunState
from tests.unit.services.runs.desk import Desk, desk
from tests.unit.services.runs.test_change import fly


def without_drop(plan: dict[str, Any]) -> None:
    plan["items"] = [item for item in plan["items"] if item["id"] != "drop"]


async def looked_at(at: Desk) -> None:
    """The run has looked at the vehicle, as it is now."""
    before = at.vehicle.looks
    await at.until(lambda: at.vehicle.looks > before + 3, "the vehicle must be looked at")


async def test_a_return_that_is_reached_before_it_is_shown_as_current_is_flown_once() -> None:
    """MISSION_CURRENT may show the item before it for a second."""
    async with desk("multicopter-loop.json", changes=without_drop) as at:
        await fly(at, "door")
        seq = at.mission.seqs_of("home")[0]
        at.vehicle.put(ItemReached(seq))
        await at.until(lambda: at.run.item_id == "home", "it flies home")
        await looked_at(at)
        assert at.run.item_id == "home", "it does not seem to fly back"
        at.vehicle.put(mission_seq=seq)
        at.vehicle.touch_down(complete=True, last_seq=seq)
        await at.until_state(RunState.COMPLETED)
        assert at.run.flown_item_ids[-2:] == ("door", "home")
        assert at.run.flown_item_ids.count("home") == 1
