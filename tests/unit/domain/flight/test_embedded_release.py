"""A drop that is a mission item needs no link: what happened unobserved is not called kept."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from app.domain.autopilot.declared import default_facts
from app.domain.drop.record import DropOutcome
from app.domain.flight.flight import LOST_AFTER_S
from app.domain.flight.inputs import FactReceived, Observation, Observed, RunEnded
from app.domain.flight.snapshot import ContingencyCommand
from app.domain.flight.step import step
from app.domain.plan import parse_plan
from app.domain.plan.compiler import compile_plan
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunState
from app.domain.vehicle.facts import MissionCurrent, Rebooted
from app.domain.vehicle.state import FlightMode, VehicleType
from tests.support.flown_flights import MISSION_ID
from tests.support.flown_to_item import APPROACH, DROP, FAR, flown_to
from tests.support.paths import PLANS


def after(seen: Observation, seconds: float, *, connected: bool) -> Observation:
    state = replace(seen.state, connected=connected)
    return replace(seen, state=state, now_s=seen.now_s + seconds)


WHERE = [
    (FAR, False, DropOutcome.KEPT),
    (APPROACH, False, DropOutcome.UNKNOWN),
    (DROP.release_seq, False, DropOutcome.UNKNOWN),
    (FAR, True, DropOutcome.UNKNOWN),
]


@pytest.mark.parametrize(("seq", "is_silent_before", "outcome"), WHERE)
def test_a_mission_that_another_client_replaced_keeps_the_parcel_only_if_its_item_was_certainly_ahead(
    seq: int, is_silent_before: bool, outcome: DropOutcome
) -> None:
    flight, seen = flown_to(seq)
    if is_silent_before:
        seen = after(seen, 1.0, connected=False)
        flight, _ = step(flight, Observed(seen))
    other = replace(seen, state=replace(seen.state, mission_id=MISSION_ID + 1, mission_seq=seq + 1))
    for later_s in (1.0, 3.0, 5.0):
        flight, _ = step(flight, Observed(after(other, later_s, connected=True)))
    failed = RunEnded(after(other, 6.0, connected=True), RunState.FAILED, Reason.of(ReasonCode.OTHER_MISSION_ON_BOARD))
    flight, _ = step(flight, failed)
    assert flight.run.drop(DROP.plan_item_id).outcome is outcome


@pytest.mark.parametrize(("seq", "is_silent_before", "outcome"), WHERE)
def test_a_reboot_keeps_the_parcel_only_if_its_item_was_certainly_ahead(
    seq: int, is_silent_before: bool, outcome: DropOutcome
) -> None:
    flight, seen = flown_to(seq)
    if is_silent_before:
        flight, _ = step(flight, Observed(after(seen, 30.0, connected=False)))
    back = after(seen, 31.0, connected=True)
    back = replace(back, state=replace(back.state, mission_seq=0, mode=FlightMode.HOLD))
    for told in (FactReceived(back, MissionCurrent(0, mission_id=MISSION_ID)), Observed(back)):
        flight, _ = step(flight, told)  # before it is noticed that the time since boot jumped back
    flight, _ = step(flight, FactReceived(back, Rebooted()))
    flight, _ = step(flight, Observed(back))
    drop = flight.run.drop(DROP.plan_item_id)
    assert flight.run.reason is not None
    assert (flight.run.reason.code, drop.outcome) == (ReasonCode.REBOOTED, outcome)


def test_a_vehicle_that_is_not_heard_any_more_may_have_released() -> None:
    flight, seen = flown_to(FAR)
    flight, _ = step(flight, Observed(after(seen, LOST_AFTER_S + 1.0, connected=False)))
    drop = flight.run.drop(DROP.plan_item_id)
    assert flight.run.reason is not None
    assert (flight.run.reason.code, drop.outcome) == (ReasonCode.NOT_HEARD, DropOutcome.UNKNOWN)


WINCH_PLAN = parse_plan(
    json.dumps(
        {**json.loads((PLANS / "winch-delivery.json").read_text()), "contingency": {"on_drop_failure": "return"}}
    )
)
WINCH_MISSION = compile_plan(WINCH_PLAN, default_facts(VehicleType.MULTICOPTER))


def test_a_winch_has_its_time_before_the_vehicle_is_sent_home() -> None:
    drop = WINCH_MISSION.drops[0]
    assert drop.release_seq is not None
    flight, seen = flown_to(drop.release_seq, WINCH_PLAN, WINCH_MISSION)
    lowering_seq = drop.release_seq + 1
    assert lowering_seq < drop.resume_seq, "the plan gives it time"

    def at(seq: int, seconds: float) -> list[object]:
        nonlocal flight
        now = after(seen, seconds, connected=True)
        now = replace(now, state=replace(now.state, mission_seq=seq))
        effects: list[object] = []
        for given in (FactReceived(now, MissionCurrent(seq, mission_id=MISSION_ID)), Observed(now)):
            flight, told = step(flight, given)
            effects += told
        return effects

    for seconds in (1.0, 5.0, 14.0):
        assert not any(isinstance(one, ContingencyCommand) for one in at(lowering_seq, seconds))
    assert flight.run.drop(drop.plan_item_id).outcome is DropOutcome.PENDING
    assert ContingencyCommand("return", drop.plan_item_id) in at(drop.resume_seq, 16.0)
    assert flight.run.drop(drop.plan_item_id).outcome is DropOutcome.UNKNOWN


def output(seen: Observation, seconds: float, newest_us: int, confirmed_us: int, mode: FlightMode) -> Observation:
    state = replace(
        seen.state,
        mode=mode,
        armed=True,
        gripper_output_newest_us=newest_us,
        gripper_output_us=confirmed_us,
        gripper_output_age_s=0.05,
    )
    return replace(seen, state=state, now_s=seen.now_s + seconds)


OPEN, CLOSED = 1000, 2000


def mode_change(opened_s: float, changed_s: float, mode: FlightMode) -> DropOutcome:
    """The outcome of a drop whose output moves, and whose vehicle leaves the mission, at these times."""
    flight, seen = flown_to(DROP.release_seq)
    for tenths in range(40):
        now_s = tenths / 10
        newest = OPEN if now_s >= opened_s else CLOSED
        confirmed = OPEN if now_s >= opened_s + 0.3 else CLOSED
        now_in = mode if now_s >= changed_s else FlightMode.MISSION
        flight, _ = step(flight, Observed(output(seen, now_s, newest, confirmed, now_in)))
    ended = RunEnded(output(seen, 4.0, newest, confirmed, now_in), RunState.ABORTED, Reason.of(ReasonCode.ENDED_EARLY))
    flight, _ = step(flight, ended)
    return flight.run.drop(DROP.plan_item_id).outcome


@pytest.mark.parametrize("mode", [FlightMode.RETURN, FlightMode.HOLD])
@pytest.mark.parametrize("changed_s", [2.0, 2.1, 2.2, 2.3])
def test_a_mode_change_just_after_the_output_moved_does_not_take_the_release_from_the_item(
    mode: FlightMode, changed_s: float
) -> None:
    assert mode_change(2.0, changed_s, mode) is DropOutcome.RELEASED


@pytest.mark.parametrize("mode", [FlightMode.RETURN, FlightMode.HOLD])
def test_an_output_that_moves_after_the_mission_was_left_is_not_the_items(mode: FlightMode) -> None:
    assert mode_change(2.5, 2.0, mode) is DropOutcome.UNKNOWN
