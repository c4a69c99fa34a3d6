"""A mission is done when its own end was seen, and not when some other mode ended with the mission stored."""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterator, Sequence
from dataclasses import replace

import pytest

from app.domain.flight.progress import MissionCompleteDetector
from app.domain.vehicle.state import FlightMode, MissionState, VehicleState
from tests.support.paths import DATA

TRACES = DATA / "traces"
MODES = {
    "AUTO.MISSION": FlightMode.MISSION,
    "AUTO.RTL": FlightMode.RETURN,
    "AUTO.LOITER": FlightMode.HOLD,
    "AUTO.LAND": FlightMode.LAND,
}
LAST = 5
HOLD, MISSION, LAND, TAKEOFF = FlightMode.HOLD, FlightMode.MISSION, FlightMode.LAND, FlightMode.TAKEOFF
ACTIVE, COMPLETE = MissionState.ACTIVE, MissionState.COMPLETE


def is_done(*looks: tuple[FlightMode, MissionState], seq: int = LAST) -> bool:
    """Whether the mission was done at any of these looks."""
    detector, done = MissionCompleteDetector(), False
    for mode, mission_state in looks:
        state = VehicleState(connected=True, mode=mode, mission_state=mission_state, mission_seq=seq)
        detector = detector.seen(state)
        done = done or detector.is_done(state, last_seq=LAST)
    return done


@pytest.mark.parametrize(
    "looks",
    [
        [(MISSION, ACTIVE), (MISSION, COMPLETE), (FlightMode.RETURN, COMPLETE)],
        [(MISSION, ACTIVE), (FlightMode.RETURN, ACTIVE), (FlightMode.RETURN, COMPLETE)],
        [(MISSION, ACTIVE), (MISSION, COMPLETE), (LAND, COMPLETE)],  # landed by hand afterwards
        [(MISSION, ACTIVE), (HOLD, COMPLETE)],
        [(LAND, COMPLETE), (MISSION, ACTIVE), (MISSION, COMPLETE)],  # flown on after a landing
    ],
)
def test_complete_counts_in_mission_return_and_hold_mode(looks: Sequence[tuple[FlightMode, MissionState]]) -> None:
    assert is_done(*looks)
    assert not is_done(*looks, seq=LAST - 1), "the index must fit too"


@pytest.mark.parametrize("mode", [LAND, FlightMode.DESCEND, TAKEOFF])
def test_the_end_of_another_mode_is_not_the_missions(mode: FlightMode) -> None:
    """On the last leg the index fits. Disarmed, the vehicle goes to Hold and still says complete (recording 22)."""
    assert not is_done((MISSION, ACTIVE), (mode, ACTIVE), (mode, COMPLETE), (HOLD, COMPLETE), (MISSION, COMPLETE))


def recorded(name: str) -> Iterator[VehicleState]:
    """What a recording of a real PX4 shows, message by message."""
    state = VehicleState(connected=True)
    with gzip.open(TRACES / name, "rt") as lines:
        for line in lines:
            message = json.loads(line)
            fields = message.get("f") or {}
            if message.get("dir") != "rx" or message.get("link") == "gcs":
                continue
            if message["name"] == "MISSION_CURRENT":
                mission_state = tuple(MissionState)[fields["mission_state"]]
                state = replace(state, mission_seq=fields["seq"], mission_state=mission_state)
            elif message["name"] == "HEARTBEAT" and "mode" in message.get("x", {}):
                state = replace(state, mode=MODES.get(message["x"]["mode"], FlightMode.OTHER))
            yield state


@pytest.mark.parametrize(
    ("name", "last_seq"),
    [("06_quad_delivery_default.jsonl.gz", 4), ("10_plane_delivery.jsonl.gz", 6)],
)
def test_recorded_missions_that_end_in_a_return_or_a_landing_are_done(name: str, last_seq: int) -> None:
    detector, done = MissionCompleteDetector(), False
    for state in recorded(name):
        detector = detector.seen(state)
        done = done or detector.is_done(state, last_seq=last_seq)
    assert done
