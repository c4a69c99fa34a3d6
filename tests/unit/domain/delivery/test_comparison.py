"""Predicted against flown: what was flown stands beside what was predicted, and every empty place has its reason."""

from __future__ import annotations

import pytest

from app.domain.delivery.comparison import Comparison, compare
from app.domain.drop.record import DropOutcome, DropPhase, DropRecord
from app.domain.events.run import RunItemEnded
from app.domain.prediction import Timeline, predict
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import Run, RunState
from tests.support.plan_pieces import facts, fixed_wing, gripper, loiter, multicopter, waypoint
from tests.support.reasons import some

PLAN = multicopter(waypoint(id="door"), gripper(id="drop"))
TIMELINE = predict(PLAN, facts())


def run(state: RunState = RunState.COMPLETED, **drop: object) -> Run:
    record = DropRecord(plan_item_id="drop", supervised=True, phase=DropPhase.DONE, attempts=1).model_copy(update=drop)
    return Run(
        id="r1",
        plan_id="p1",
        plan_hash="",
        vehicle_id="v1",
        state=state,
        drops=(record,),
        created_at=0.0,
        updated_at=0.0,
    )


def flown(*took: float) -> list[RunItemEnded]:
    """Items one after the other, from 100 s on the vehicle's clock."""
    at_s, found = 100.0, []
    for item_id, seconds in zip(TIMELINE.order, took, strict=False):
        found.append(RunItemEnded(item_id=item_id, began_s=at_s, ended_s=at_s + seconds))
        at_s += seconds
    return found


def by_id(comparison: Comparison) -> dict[str, tuple[float | None, str]]:
    return {item.item_id: (item.flown_s, item.reason) for item in comparison.items}


def test_each_item_has_both_times_and_their_difference() -> None:
    predicted = [entry.duration_s for entry in TIMELINE.entries]
    comparison = compare(run(), TIMELINE, flown(*(1.1 * seconds for seconds in predicted)))
    assert [item.predicted_s for item in comparison.items] == predicted
    assert [item.difference_percent for item in comparison.items] == [pytest.approx(10.0)] * 4
    assert comparison.flown_s == pytest.approx(1.1 * TIMELINE.duration_s)
    assert {item.reason for item in comparison.items} == {None}


def test_a_pause_is_told_and_counts_in_no_time() -> None:
    took = flown(*(entry.duration_s + 60.0 for entry in TIMELINE.entries[:1]))
    comparison = compare(run(RunState.FLYING), TIMELINE, [took[0].model_copy(update={"paused_s": 60.0})])
    first = comparison.items[0]
    assert (first.flown_s, first.paused_s) == (pytest.approx(first.predicted_s), 60.0)
    assert first.difference_percent == pytest.approx(0.0, abs=1e-6)
    assert (comparison.flown_s, comparison.paused_s) == (first.flown_s, 60.0)
    unseen = compare(
        run(), TIMELINE, [RunItemEnded(item_id=took[0].item_id, began_s=None, ended_s=200.0, paused_s=60.0)]
    )
    assert (unseen.items[0].flown_s, unseen.items[0].paused_s, unseen.paused_s) == (None, 0.0, 0.0)


def test_what_was_not_flown_is_null_and_says_so() -> None:
    aborted = by_id(compare(run(RunState.ABORTED), TIMELINE, flown(15.0)))
    assert aborted["item-1"] == (pytest.approx(15.0), None)
    assert aborted["door"] == (None, Reason.of(ReasonCode.NOT_FLOWN, state="aborted"))
    assert by_id(compare(run(RunState.FLYING), TIMELINE, flown(15.0)))["door"] == (
        None,
        Reason.of(ReasonCode.NOT_FLOWN_YET),
    )


def test_what_ended_unseen_is_null_and_says_so() -> None:
    ended = [*flown(15.0), RunItemEnded(item_id="door", began_s=115.0, ended_s=None)]
    flown_s, reason = by_id(compare(run(), TIMELINE, ended))["door"]
    assert flown_s is None
    assert reason == Reason.of(ReasonCode.ENDS_UNSEEN)


def test_a_parcel_that_was_kept_has_no_time_of_a_release() -> None:
    kept = run(attempts=0, outcome=DropOutcome.KEPT, reason=some("the gripper is open"))
    comparison = compare(kept, TIMELINE, flown(15.0, 30.0, 0.0))
    assert by_id(comparison)["drop"] == (None, Reason.of(ReasonCode.NO_RELEASE_SENT, some("the gripper is open")))
    assert comparison.drops[0].distance_m is None
    assert comparison.drops[0].reason == by_id(comparison)["drop"][1]


def test_a_drop_stands_beside_its_prediction() -> None:
    (predicted,) = TIMELINE.drops
    assert predicted.release_latitude_deg is not None
    there = {
        "latitude_deg": predicted.release_latitude_deg + 1.0 / 111_195,
        "longitude_deg": predicted.release_longitude_deg,
        "offset_m": 1.0,
        "ground_speed_m_s": 0.2,
    }
    (drop,) = compare(run(**there), TIMELINE, []).drops
    assert drop.distance_m == pytest.approx(1.0, abs=0.01)
    assert (drop.predicted_offset_m, drop.flown_offset_m, drop.flown_ground_speed_m_s) == (1.0, 1.0, 0.2)
    assert drop.reason is None


def test_on_a_circle_only_offset_and_speed_are_compared() -> None:
    circling = predict(fixed_wing(loiter(radius_m=70), gripper("moving", id="drop")), facts("fixed_wing"))
    record = {"supervised": False, "latitude_deg": 47.0, "longitude_deg": 8.0, "offset_m": 72.0}
    (drop,) = compare(run(**record), circling, []).drops
    assert (drop.distance_m, drop.predicted_offset_m, drop.flown_offset_m) == (None, 70, 72.0)
    assert drop.reason == Reason.of(ReasonCode.PLACE_NOT_PREDICTED)


def test_without_a_prediction_the_flown_times_are_told_all_the_same() -> None:
    comparison = compare(run(), None, flown(15.0, 30.0), some("it was not recorded"))
    assert [(item.item_id, item.predicted_s) for item in comparison.items] == [("item-1", None), ("door", None)]
    assert [item.reason for item in comparison.items] == [some("it was not recorded")] * len(comparison.items)
    assert comparison.reason == some("it was not recorded")


def test_of_a_long_prediction_the_first_visits_are_kept() -> None:
    short = TIMELINE.first(2)
    assert (short.order, short.drops, short.truncated) == (TIMELINE.order[:2], (), True)
    assert TIMELINE.first(4) is TIMELINE
    assert Timeline.model_validate(short.model_dump(mode="json")) == short
