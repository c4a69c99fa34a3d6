"""After a landing that was not the mission's, a run neither pauses nor flies on, whatever PX4 shows as it disarms."""

from __future__ import annotations

import pytest

from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunAction, RunState
from app.domain.vehicle.state import FlightMode, LandedState
from tests.support.told_flight import Told

SHOWN = (FlightMode.OFFBOARD, FlightMode.HOLD, FlightMode.MISSION, FlightMode.POSITION, FlightMode.OTHER)


@pytest.mark.parametrize("shown", SHOWN)
@pytest.mark.parametrize("down_in", [FlightMode.LAND, FlightMode.RETURN])
@pytest.mark.parametrize("commanded", [None, RunAction.PAUSE, RunAction.LAND, RunAction.RETURN])
def test_a_run_that_has_come_down_stays_returning(
    shown: FlightMode, down_in: FlightMode, commanded: RunAction | None
) -> None:
    told = Told()
    told.see()
    if commanded is not None:
        told.command(commanded)
    told.see(3.0, mode=down_in)
    told.touch_down()
    told.see(0.5, mode=shown)
    assert (told.run.state, told.run.reason) == (RunState.RETURNING, Reason.of(ReasonCode.ON_GROUND))
    told.see(6.0, armed=False)
    assert told.run.is_over
    assert told.states[:2] == [RunState.FLYING, RunState.RETURNING]
    assert not {RunState.FLYING, RunState.PAUSED} & {*told.states[2:]}


@pytest.mark.parametrize("shown", SHOWN)
@pytest.mark.parametrize("down_in", [FlightMode.OTHER, FlightMode.POSITION])
def test_a_paused_run_that_a_failsafe_or_a_pilot_landed_stays_paused_for_the_same_reason(
    shown: FlightMode, down_in: FlightMode
) -> None:
    told = Told()
    told.see()
    told.see(4.0, mode=down_in, in_failsafe=down_in is FlightMode.OTHER)
    paused_for = told.run.reason
    assert told.run.state is RunState.PAUSED
    told.touch_down()
    told.see(3.0, mode=shown, in_failsafe=False)
    assert (told.run.state, told.run.reason) == (RunState.PAUSED, paused_for)
    told.see(6.0, armed=False)
    assert told.states == [RunState.FLYING, RunState.PAUSED, RunState.LANDED, RunState.FAILED]


def test_a_vehicle_that_takes_off_again_flies_on() -> None:
    told = Told()
    told.see()
    told.see(4.0, mode=FlightMode.POSITION)
    told.touch_down()
    told.see(mode=FlightMode.MISSION)
    assert told.run.state is RunState.PAUSED
    told.see(landed=LandedState.TAKING_OFF)
    assert told.run.state is RunState.FLYING


def test_a_mission_that_lands_on_its_way_is_paused_and_resumed_on_the_ground() -> None:
    told = Told()
    told.see()
    told.touch_down()
    told.command(RunAction.PAUSE)
    told.see(3.0, mode=FlightMode.HOLD)
    assert told.run.state is RunState.PAUSED
    told.command(RunAction.RESUME)
    told.see(mode=FlightMode.MISSION)
    assert told.run.state is RunState.FLYING
