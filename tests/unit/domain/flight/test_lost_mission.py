"""PX4 drops a mission in flight, for example because another client has uploaded a smaller geofence."""

from __future__ import annotations

import pytest

from app.domain.flight.inputs import FactReceived
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunAction, RunState
from app.domain.vehicle.facts import MavSeverity, StatusText
from app.domain.vehicle.state import FlightMode, MissionState
from tests.support.told_flight import Told

VIOLATION = StatusText(MavSeverity.CRITICAL, "Geofence violation for waypoint 3")
LOITERS = StatusText(MavSeverity.CRITICAL, "No valid mission available, loitering")
DROPPED = {"mode": FlightMode.HOLD, "mission_state": MissionState.NO_MISSION}


def lost_for(detail: str) -> Reason:
    return Reason.of(ReasonCode.NO_VALID_MISSION, detail=detail)


def test_the_vehicles_texts_say_why_it_dropped_its_mission() -> None:
    told = Told()
    told.see(1.0)
    told.feed(FactReceived(told.observed, VIOLATION))
    told.see(0.3, mode=FlightMode.HOLD)
    told.feed(FactReceived(told.observed, LOITERS))
    told.see(5.0, **DROPPED)
    assert (told.run.state, told.run.reason) == (RunState.PAUSED, lost_for(f"{VIOLATION.text}; {LOITERS.text}"))


@pytest.mark.parametrize(
    "text",
    [
        StatusText(MavSeverity.INFO, "Executing Mission"),
        StatusText(MavSeverity.CRITICAL, VIOLATION.text, repeated=3),
    ],
    ids=["not serious", "a count of repeats"],
)
def test_other_texts_are_no_reason(text: StatusText) -> None:
    told = Told()
    told.feed(FactReceived(told.observed, text))
    told.see(5.0, **DROPPED)
    assert told.run.reason == lost_for("it gave no reason")


def test_a_text_from_long_before_is_no_reason() -> None:
    told = Told()
    told.feed(FactReceived(told.observed, VIOLATION))
    told.see(10.0)
    told.see(5.0, **DROPPED)
    told.feed(FactReceived(told.observed, LOITERS))
    told.see()
    assert told.run.reason == lost_for("it gave no reason")


def test_a_mission_that_is_valid_again_leaves_a_vehicle_that_holds() -> None:
    told = Told()
    told.see(5.0, **DROPPED)
    told.see(5.0, mission_state=MissionState.PAUSED)
    assert told.run.reason == Reason.of(ReasonCode.TAKEN_BY_OTHERS, mode="hold")
    told.see(1.0, mode=FlightMode.MISSION, mission_state=MissionState.ACTIVE)
    assert told.run.state is RunState.FLYING


def test_what_a_person_commands_then_is_told_as_theirs() -> None:
    told = Told()
    told.see(5.0, **DROPPED)
    told.command(RunAction.RETURN)
    told.see(3.0, mode=FlightMode.RETURN)
    assert (told.run.state, told.run.reason) == (RunState.RETURNING, Reason.of(ReasonCode.RETURNING_AS_ASKED))
