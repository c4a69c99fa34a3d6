"""What a run in flight is said to be follows what is seen, and blames nobody wrongly."""

from __future__ import annotations

import dataclasses

import pytest

from app.domain.flight.phase import AGREED_S, ALONE_S, PhaseFacts, final_state, is_landing_unsure, phase_of
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunAction, RunState
from app.domain.vehicle.state import FlightMode, LandedState, SignalDurations, VehicleState, VehicleType

FLYING = PhaseFacts(
    state=VehicleState(connected=True, mode=FlightMode.MISSION, armed=True, landed=LandedState.IN_AIR),
    vehicle_type=VehicleType.MULTICOPTER,
    at_drop=False,
    mission_done=False,
    was_airborne=True,
    commanded=None,
)
OFFBOARD = dataclasses.replace(FLYING, commanded=RunAction.PAUSE, after_offboard=True)
"""The pause was asked for on the way into offboard control."""


def seen(view: PhaseFacts = FLYING, **state: object) -> PhaseFacts:
    return dataclasses.replace(view, state=dataclasses.replace(view.state, **state))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("view", "state", "code"),
    [
        (FLYING, RunState.FLYING, None),
        (dataclasses.replace(FLYING, at_drop=True), RunState.AT_DROP, None),
        (seen(mode=FlightMode.RETURN), RunState.RETURNING, ReasonCode.RETURN_BY_OTHERS),
        (seen(mode=FlightMode.RETURN, in_failsafe=True), RunState.RETURNING, ReasonCode.FAILSAFE),
        (
            seen(dataclasses.replace(FLYING, commanded=RunAction.RETURN), mode=FlightMode.RETURN),
            RunState.RETURNING,
            ReasonCode.RETURNING_AS_ASKED,
        ),
        (
            seen(dataclasses.replace(FLYING, commanded=RunAction.LAND, is_unobeyed=True), mode=FlightMode.RETURN),
            RunState.RETURNING,
            None,
        ),
        (
            seen(dataclasses.replace(FLYING, mission_done=True), mode=FlightMode.RETURN),
            RunState.RETURNING,
            ReasonCode.MISSION_DONE,
        ),
        (
            seen(dataclasses.replace(FLYING, commanded=RunAction.PAUSE), mode=FlightMode.HOLD),
            RunState.PAUSED,
            ReasonCode.PAUSED_AS_ASKED,
        ),
        (seen(OFFBOARD, mode=FlightMode.OFFBOARD), RunState.PAUSED, ReasonCode.OFFBOARD),
        (seen(OFFBOARD, mode=FlightMode.HOLD), RunState.PAUSED, ReasonCode.AFTER_OFFBOARD),
        (seen(OFFBOARD, mode=FlightMode.HOLD, in_failsafe=True), RunState.PAUSED, ReasonCode.AFTER_OFFBOARD_FAILSAFE),
        (seen(mode=FlightMode.HOLD), RunState.PAUSED, ReasonCode.TAKEN_BY_OTHERS),
        (seen(mode=FlightMode.MANUAL), RunState.PAUSED, ReasonCode.TAKEN_BY_OTHERS),
        (seen(mode=FlightMode.LAND), RunState.RETURNING, ReasonCode.LAND_BY_OTHERS),
        (seen(mode=FlightMode.LAND, in_failsafe=True), RunState.RETURNING, ReasonCode.FAILSAFE_MODE),
        (seen(mode=FlightMode.DESCEND, in_failsafe=True), RunState.RETURNING, ReasonCode.FAILSAFE_MODE),
        (seen(in_failsafe=True, is_terminated=True), RunState.RETURNING, ReasonCode.TERMINATED),
        (seen(armed=False), RunState.LANDED, None),
    ],
)
def test_the_phase_follows_mode_and_arming(view: PhaseFacts, state: RunState, code: ReasonCode | None) -> None:
    phase, reason = phase_of(view)
    assert phase is state
    assert (reason.code if reason else None) is code


def test_a_return_that_has_landed_is_no_mission_that_goes_on() -> None:
    """PX4 shows Mission mode for a moment between touchdown and disarming."""
    touched_down = seen(dataclasses.replace(FLYING, was_returning=True), landed=LandedState.ON_GROUND)
    assert phase_of(touched_down) == (RunState.RETURNING, Reason.of(ReasonCode.ON_GROUND))
    assert phase_of(dataclasses.replace(FLYING, was_returning=True))[0] is RunState.FLYING, "in the air it goes on"
    assert phase_of(seen(landed=LandedState.ON_GROUND))[0] is RunState.FLYING, "a mission that lands on its way"


def test_a_rover_ends_stopped_at_its_last_item_still_armed() -> None:
    rover = dataclasses.replace(FLYING, vehicle_type=VehicleType.ROVER, mission_done=True)
    moving = seen(rover, mode=FlightMode.HOLD, velocity_north_m_s=2.0, velocity_east_m_s=0.0)
    assert phase_of(moving)[0] is not RunState.LANDED
    stopped = seen(rover, mode=FlightMode.HOLD, velocity_north_m_s=0.0, velocity_east_m_s=0.0)
    assert phase_of(stopped)[0] is RunState.LANDED


def test_an_airship_ends_where_it_holds_as_it_says_landed_only_when_disarmed() -> None:
    airship = dataclasses.replace(FLYING, vehicle_type=VehicleType.AIRSHIP)
    assert phase_of(seen(airship, mode=FlightMode.HOLD))[0] is RunState.PAUSED, "somebody stopped it on its way"
    done = dataclasses.replace(airship, mission_done=True)
    assert phase_of(seen(done, mode=FlightMode.HOLD))[0] is RunState.LANDED


@pytest.mark.parametrize(
    ("done", "commanded", "state"),
    [
        (True, None, RunState.COMPLETED),
        (False, RunAction.RETURN, RunState.ABORTED),
        (True, RunAction.RETURN, RunState.COMPLETED),  # it was done before anybody asked
        (False, RunAction.CONTINGENCY, RunState.ABORTED),
        (False, None, RunState.FAILED),
    ],
)
def test_a_landing_is_a_success_only_with_the_mission_done(
    done: bool, commanded: RunAction | None, state: RunState
) -> None:
    assert final_state(mission_done=done, commanded=commanded, reason=None)[0] is state


def test_a_return_that_is_commanded_while_the_mission_lands_aborts_it() -> None:
    """PX4 reports a landing item as reached when it begins."""
    ended = final_state(mission_done=True, commanded=RunAction.RETURN, reason=None, lands_at_end=True)
    assert ended == (RunState.ABORTED, Reason.of(ReasonCode.ASKED_BEFORE_DONE, asked="return"))
    assert final_state(mission_done=True, commanded=None, reason=None, lands_at_end=True)[0] is RunState.COMPLETED


@pytest.mark.parametrize(
    ("durations", "is_unsure"),
    [
        (SignalDurations(AGREED_S, AGREED_S, AGREED_S), False),
        (SignalDurations(AGREED_S - 0.1, 9.0, 9.0), True),
        (SignalDurations(9.0, AGREED_S - 0.1, 9.0), True),
        (SignalDurations(9.0, 9.0, AGREED_S - 0.1), True),
        (SignalDurations(ALONE_S, 0.0, 0.0), False),
        (None, False),
    ],
)
def test_a_disarmed_vehicle_has_landed_only_once_its_messages_agree(
    durations: SignalDurations | None, is_unsure: bool
) -> None:
    assert is_landing_unsure(VehicleState(armed=False, durations=durations)) is is_unsure


def test_a_rover_that_stopped_for_a_moment_has_not_ended_its_run() -> None:
    at_end = dataclasses.replace(FLYING, vehicle_type=VehicleType.ROVER, mission_done=True)
    stopped = seen(at_end, velocity_north_m_s=0.0, velocity_east_m_s=0.0, durations=SignalDurations(at_rest_s=0.5))
    assert phase_of(stopped)[0] is RunState.FLYING
    assert phase_of(seen(stopped, durations=SignalDurations(at_rest_s=AGREED_S)))[0] is RunState.LANDED
