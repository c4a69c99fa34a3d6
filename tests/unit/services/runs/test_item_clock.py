"""A run records what was predicted before it flies, and when each item began and ended."""

from __future__ import annotations

from typing import Any

from app.domain.drop import DropOutcome
from app.domain.events import EventKind
from app.domain.prediction import Timeline
from app.services.comparisons import Comparisons
from tests.unit.services.runs.desk import Desk, desk


def told(at: Desk, kind: EventKind) -> list[dict[str, Any]]:
    return [event.data for event in at.events.events if event.kind is kind]


async def flown_to_the_end(at: Desk) -> None:
    await at.create()
    await at.fly_to_drop()
    await at.until(lambda: at.drop.outcome is DropOutcome.RELEASED, "the parcel must be released")
    at.vehicle.touch_down(complete=True, last_seq=len(at.mission.items) - 1)
    await at.until(lambda: at.run.is_over, "the run must end after the landing")


async def test_the_prediction_is_recorded_before_the_vehicle_is_touched() -> None:
    async with desk() as at:
        await at.create(start=False)
        assert at.kinds()[:2] == ["run.created", "run.predicted"]
        (data,) = told(at, EventKind.RUN_PREDICTED)
        assert Timeline.model_validate(data).order == ("takeoff", "corner", "clinic", "drop", "home")


async def test_each_item_that_was_flown_is_told_once_in_order_and_without_holes() -> None:
    async with desk() as at:
        await flown_to_the_end(at)
        ended = told(at, EventKind.RUN_ITEM_ENDED)
        assert [item["item_id"] for item in ended] == ["takeoff", "corner", "clinic", "drop", "home"]
        seen = [item for item in ended if None not in (item["began_s"], item["ended_s"])]
        assert all(item["began_s"] <= item["ended_s"] for item in seen)


async def test_the_comparison_is_made_of_the_runs_own_events() -> None:
    async with desk() as at:
        await flown_to_the_end(at)
        comparison = await Comparisons(at.runs, at.journal).of(at.run_id)
        assert [item.item_id for item in comparison.items] == ["takeoff", "corner", "clinic", "drop", "home"]
        assert all((item.flown_s is None) == (item.reason != "") for item in comparison.items)
        (drop,) = comparison.drops
        assert drop.apart_m is not None
        assert comparison.reason == ""


async def test_a_prediction_of_another_version_is_not_guessed_at() -> None:
    async with desk() as at:
        await at.create(start=False)
        index = next(n for n, event in enumerate(at.events.events) if event.kind is EventKind.RUN_PREDICTED)
        at.events.events[index] = at.events.events[index].model_copy(update={"data": {"entries": "later"}})
        comparison = await Comparisons(at.runs, at.journal).of(at.run_id)
        assert comparison.items == ()
        assert "another version" in comparison.reason
