"""What somebody else does with the gripper in flight is never told as a drop's own, nor its parcel as kept."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from app.domain.autopilot.declared import default_facts
from app.domain.drop.record import Certainty, DropOutcome, DropRecord, GripperUse
from app.domain.events.run import RunDrop
from app.domain.flight.flight import Flight
from app.domain.flight.inputs import FactReceived, GripperUsed, Observation, Observed, RecordEvent, RunEnded
from app.domain.flight.recovery import ended_unseen
from app.domain.flight.segment import drop_records, drops_after_change
from app.domain.flight.step import step
from app.domain.plan import parse_plan
from app.domain.plan.compiler import compile_plan
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunState
from app.domain.vehicle.facts import MissionCurrent
from app.domain.vehicle.state import FlightMode, LandedState, VehicleType
from tests.support.flown_flights import DROP, MISSION_ID, Flown, a_flight, a_run
from tests.support.flown_to_item import APPROACH, FAR, flown_to
from tests.support.paths import PLANS

ABORTED = Reason.of(ReasonCode.ENDED_EARLY)
OPEN, CLOSED = 1000, 2000


def record_of(flight: Flight) -> DropRecord:
    return flight.run.drop(DROP.plan_item_id)


def unknown_because(record: DropRecord) -> list[ReasonCode]:
    assert (record.outcome, record.certainty) == (DropOutcome.UNKNOWN, Certainty.NONE)
    assert record.reason is not None
    return list(record.reason.codes)


def at(seen: Observation, seconds: float, output_us: int, **state: object) -> Observation:
    held = replace(seen.state, gripper_output_us=output_us, gripper_output_age_s=0.05, armed=True, **state)
    return replace(seen, state=held, now_s=seen.now_s + seconds)


# A supervised drop.


def test_what_a_task_did_with_the_gripper_is_stored_before_and_the_release_at_the_drop_proves_nothing() -> None:
    flown = Flown()
    flown.tick()
    flown.feed(GripperUsed(flown.observed))
    assert record_of(flown.flight).gripper_used_by is GripperUse.TASK
    assert isinstance(flown.recorded[-1], RunDrop), "it must be stored before the command"
    record = flown.to_the_end().drop(DROP.plan_item_id)
    assert record.attempts == 1
    assert unknown_because(record)[0] is ReasonCode.DROP_GRIPPER_BY_TASK


def test_neither_is_the_parcel_kept_by_a_run_that_ends_before_its_drop() -> None:
    flown = Flown()
    flown.tick()
    flown.feed(GripperUsed(flown.observed))
    flown.feed(RunEnded(flown.observed, RunState.ABORTED, ABORTED))
    assert unknown_because(record_of(flown.flight)) == [ReasonCode.DROP_GRIPPER_BY_TASK, ReasonCode.ENDED_EARLY]


def test_a_restart_of_the_service_forgets_nothing_of_it() -> None:
    flown = Flown()
    flown.tick()
    flown.feed(GripperUsed(flown.observed))
    again = flown.restarted(1.0)
    assert unknown_because(again.to_the_end().drop(DROP.plan_item_id))[0] is ReasonCode.DROP_GRIPPER_BY_TASK
    unseen = ended_unseen(flown.run, RunState.LOST, ABORTED, flown.now_s)
    assert unknown_because(unseen.drop(DROP.plan_item_id))[0] is ReasonCode.DROP_GRIPPER_BY_TASK


def test_a_pilot_who_opens_and_closes_it_on_the_way_is_not_forgotten() -> None:
    flown = Flown()
    for seconds in range(4):
        flown.feed(Observed(at(flown.observed, seconds, CLOSED)))
    flown.feed(Observed(at(flown.observed, 5.0, OPEN, mode=FlightMode.HOLD)))
    flown.feed(Observed(at(flown.observed, 6.0, CLOSED)))
    assert record_of(flown.flight).gripper_used_by is GripperUse.OTHERS
    flown.feed(RunEnded(flown.observed, RunState.ABORTED, ABORTED))
    assert unknown_because(record_of(flown.flight)) == [ReasonCode.ITEM_STRAYED, ReasonCode.ENDED_EARLY]


def test_a_gripper_that_is_closed_for_takeoff_was_used_by_nobody() -> None:
    flown = Flown()
    flown.feed(Observed(at(flown.observed, 0.0, OPEN, landed=LandedState.ON_GROUND)))
    flown.feed(Observed(at(flown.observed, 1.0, OPEN, landed=LandedState.TAKING_OFF)))  # of before the grab
    flown.feed(Observed(at(flown.observed, 2.0, CLOSED)))
    assert record_of(flown.flight).gripper_used_by is None
    assert flown.to_the_end().drop(DROP.plan_item_id).outcome is DropOutcome.RELEASED


def test_a_parcel_that_was_kept_is_doubted_if_a_changed_plan_tries_it_again() -> None:
    kept = a_run().drops[0].model_copy(update={"outcome": DropOutcome.KEPT, "phase": "done"})
    flight = a_flight(a_run().with_drop(kept, now=1.0))
    flight, _ = step(flight, GripperUsed(Flown().observed))
    assert record_of(flight).outcome is DropOutcome.KEPT, "at that place it was"
    (again,) = drops_after_change(flight.run.drops, flight.segment.mission)
    assert (again.outcome, again.gripper_used_by) == (DropOutcome.PENDING, GripperUse.TASK)


# A drop that is a mission item.


def seen_by(flight: Flight, *seen: Observation) -> Flight:
    for one in seen:
        flight, _ = step(flight, Observed(one))
    return flight


def test_a_task_that_releases_an_embedded_parcel_elsewhere_delivers_nothing() -> None:
    flight, seen = flown_to(APPROACH)
    flight, effects = step(flight, GripperUsed(seen))
    assert any(isinstance(effect, RecordEvent) and isinstance(effect.payload, RunDrop) for effect in effects)
    flight = seen_by(flight, at(seen, 1.0, CLOSED), at(seen, 2.0, OPEN), at(seen, 3.0, CLOSED))
    assert unknown_because(record_of(flight))[0] is ReasonCode.DROP_GRIPPER_BY_TASK


@pytest.mark.parametrize("seq", [FAR, APPROACH])
def test_a_pilot_who_opens_and_closes_it_amid_a_pause_delivers_nothing_and_keeps_nothing(seq: int) -> None:
    flight, seen = flown_to(seq)
    flight = seen_by(flight, *(at(seen, seconds, CLOSED) for seconds in (0.5, 1.0, 1.5, 2.0)))
    paused = [at(seen, 3.0, OPEN, mode=FlightMode.HOLD), at(seen, 4.0, CLOSED, mode=FlightMode.HOLD)]
    flight = seen_by(flight, *paused)
    assert record_of(flight).gripper_used_by is GripperUse.OTHERS
    assert record_of(flight).outcome is DropOutcome.PENDING
    flight, _ = step(flight, RunEnded(at(seen, 5.0, CLOSED), RunState.ABORTED, ABORTED))
    assert unknown_because(record_of(flight))[0] is ReasonCode.ITEM_STRAYED


# Several drops, and a grab of the mission between them.


def two_drops(mode: str) -> str:
    place = {"type": "waypoint", "latitude_deg": 47.3979, "longitude_deg": 8.5456, "relative_altitude_m": 15}
    drop = {"type": "gripper", "action": "release", "release_motion": "stopped", "mode": mode, "max_offset_m": 2}
    plan = json.loads((PLANS / "multicopter-embedded.json").read_text(encoding="utf-8"))
    first, *_, last = plan["items"]
    shop = {**place, "latitude_deg": 47.3984, "id": "shop"}
    grab = {"id": "grab", "type": "gripper", "action": "grab", "release_motion": "stopped", "mode": "embedded"}
    again = {**place, "latitude_deg": 47.3989, "id": "b-place"}
    if mode == "supervised":
        place, again = {**place, "hold_s": 20}, {**again, "hold_s": 20}
    stops = [{**place, "id": "a-place"}, {**drop, "id": "a"}, shop, grab, again, {**drop, "id": "b"}]
    return json.dumps({**plan, "items": [first, *stops, last]})


@pytest.mark.parametrize("mode", ["embedded", "supervised"])
def test_what_the_mission_grabs_later_is_not_doubted(mode: str) -> None:
    plan = parse_plan(two_drops(mode))
    mission = compile_plan(plan, default_facts(VehicleType.MULTICOPTER))
    before, after = min(mission.drops[0].hold_seqs), min(mission.drops[1].hold_seqs)
    for seq, doubted in ((before, {"a"}), (after, {"a", "b"})):
        flight, seen = flown_to(seq, plan, mission)
        flight, _ = step(flight, GripperUsed(seen))
        assert {one.plan_item_id for one in flight.run.drops if one.gripper_used_by} == doubted


@pytest.mark.parametrize("mode", ["embedded", "supervised"])
def test_the_missions_own_release_and_grab_are_no_use_by_others(mode: str) -> None:
    plan = parse_plan(two_drops(mode))
    mission = compile_plan(plan, default_facts(VehicleType.MULTICOPTER))
    a, b = mission.drops
    grab = next(item.seq for item in mission.items if item.param2 == 1.0 and item.command.name == "DO_GRIPPER")
    flight, seen = flown_to(min(a.hold_seqs), plan, mission)
    way = [(min(a.hold_seqs), CLOSED), (max(a.hold_seqs), OPEN), (a.resume_seq, OPEN), (grab, OPEN)]
    way += [(grab + 1, OPEN), (grab + 1, CLOSED), (min(b.hold_seqs), CLOSED)]
    for count, (seq, output_us) in enumerate(way):
        for tenth in range(6):
            now = at(seen, count * 0.6 + tenth / 10, output_us, mission_seq=seq)
            flight, _ = step(flight, FactReceived(now, MissionCurrent(seq, mission_id=MISSION_ID)))
            flight, _ = step(flight, Observed(now))
    assert flight.run.drop("b").gripper_used_by is None
    assert drop_records(mission)[1].gripper_used_by is None
