"""The end of a run says where its vehicle was heard last: somebody may have to fetch it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.drop.record import DropOutcome
from app.domain.flight.inputs import Recovered
from app.domain.flight.snapshot import ReleaseCommand
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import LastPosition, RunAction, RunState
from app.domain.vehicle.state import FlightMode, GnssFix, LandedState, VehicleState
from tests.support.flown_flights import BEGAN_AT, BEGAN_S, Flown, a_flight, a_run
from tests.support.told_flight import LAST_SEQ, Told

AWAY = {"latitude_deg": 47.4, "longitude_deg": 8.55}


def test_a_run_that_ends_says_where_the_vehicle_stands() -> None:
    told = Told()
    told.return_at_end()
    told.see(3.0, mode=FlightMode.LAND, in_failsafe=True, **AWAY)
    assert told.run.last_position is None, "the vehicle's own state says where it is in flight"
    told.touch_down()
    told.disarm(FlightMode.HOLD)
    assert told.run.state is RunState.FAILED
    at = BEGAN_AT + told.now_s - BEGAN_S
    heard = told.run.last_position
    assert heard is not None
    assert heard.at == pytest.approx(at, abs=6.0), "while it waited for its messages to agree"
    assert (heard.latitude_deg, heard.longitude_deg) == tuple(AWAY.values())


def test_a_lost_run_says_where_and_when_its_vehicle_was_heard() -> None:
    told = Told()
    told.see(5.0, **AWAY)
    heard_s = told.now_s
    for _ in range(4000):
        if told.run.is_over:
            break
        told.see(1.0, connected=False, position_age_s=told.now_s + 1.0 - heard_s)
    assert told.run.state is RunState.LOST
    heard = told.run.last_position
    assert heard == LastPosition(**AWAY, at=heard.at if heard else 0.0)
    assert heard.at == pytest.approx(BEGAN_AT + heard_s - BEGAN_S, abs=1.5)


@pytest.mark.parametrize(("fix", "is_estimated"), [(GnssFix.NO_GPS, True), (GnssFix.FIX_3D, False), (None, False)])
def test_a_position_without_a_fix_is_an_estimate(fix: GnssFix | None, is_estimated: bool) -> None:
    told = Told()
    told.return_at_end()
    told.see(3.0, mode=FlightMode.LAND, in_failsafe=True, gnss_fix=fix, **AWAY)
    told.touch_down()
    told.disarm(FlightMode.HOLD)
    assert told.run.last_position is not None
    assert told.run.last_position.is_estimated is is_estimated


def test_a_run_whose_vehicle_sent_no_position_has_none() -> None:
    told = Told()
    told.return_at_end()
    told.see(position_age_s=None, latitude_deg=None, longitude_deg=None)
    told.touch_down()
    told.disarm(FlightMode.HOLD)
    assert told.run.is_over
    assert told.run.last_position is None


# A return makes the mission's landing current with RTL_TYPE 1 to 4; here it is another item ahead.


@pytest.mark.parametrize("first", ["item", "mode"])
def test_a_return_that_was_commanded_flies_no_item_of_the_mission(first: str) -> None:
    told = Told()
    told.see(mission_seq=1)
    flown = told.run.flown_item_ids
    told.command(RunAction.RETURN)
    if first == "item":  # MISSION_CURRENT comes some milliseconds before HEARTBEAT
        told.see(mission_seq=LAST_SEQ - 1)
    told.see(3.0, mode=FlightMode.RETURN, mission_seq=LAST_SEQ - 1)
    told.command(RunAction.PAUSE)
    told.see(5.0, mode=FlightMode.HOLD)
    assert told.run.flown_item_ids == flown
    assert told.flight.resumes_at == 1, "it would fly to the landing by itself"
    told.command(RunAction.RESUME)
    told.see(1.0, mode=FlightMode.MISSION, mission_seq=1)
    assert told.flight.resumes_at is None


def test_a_return_that_is_found_after_a_restart_flies_no_item_of_the_mission() -> None:
    told = Told()
    told.see(mission_seq=1)
    flown = told.run.flown_item_ids
    told.command(RunAction.RETURN)
    told.see(3.0, mode=FlightMode.RETURN, mission_seq=LAST_SEQ - 1)
    told.restart()
    told.see()
    assert told.run.flown_item_ids == flown


def test_what_the_vehicle_flew_before_a_pause_was_seen_counts() -> None:
    told = Told()
    told.see(mission_seq=1)
    told.see(5.0, mode=FlightMode.HOLD, mission_seq=2)
    assert told.flight.progress.current == 2
    assert told.flight.resumes_at is None


# A start that a restart of the service broke off: armed, and on the ground.


def test_a_vehicle_that_a_broken_start_left_armed_is_nobody_elses_and_has_not_flown() -> None:
    told = Told(flight=a_flight(a_run().model_copy(update={"state": RunState.STARTING, "started_at": None})))
    told.state = replace(told.state, mode=FlightMode.HOLD, landed=LandedState.ON_GROUND, mission_seq=0)
    told.feed(Recovered(told.observed, in_flight=True, flown=(), current=0))
    told.see(9.0)
    left = Reason.of(ReasonCode.RESTART_DURING_START_ARMED)
    assert (told.run.state, told.run.reason) == (RunState.FLYING, left)
    told.see(9.0, armed=False)
    assert (told.run.state, told.run.reason) == (
        RunState.FAILED,
        Reason.of(ReasonCode.DISARMED_BEFORE_TAKEOFF),
    )


class TooHigh(Flown):
    """It hovers 15 m above where it is to drop its parcel."""

    @property
    def state(self) -> VehicleState:
        return replace(super().state, relative_altitude_m=30.0)


def test_a_parcel_is_not_released_from_twice_the_planned_height() -> None:
    flown = TooHigh()
    run = flown.to_the_end()
    assert not [one for one in flown.commands if isinstance(one, ReleaseCommand)]
    assert run.drops[0].outcome is DropOutcome.KEPT
    assert run.drops[0].reason == Reason.of(ReasonCode.WRONG_HEIGHT, max_height_error_m=3.0)
