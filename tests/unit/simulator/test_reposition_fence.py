"""DO_REPOSITION and a plane's DO_ORBIT to a place that the fence forbids: accepted, said, and not flown."""

from __future__ import annotations

import pytest

from app.simulator.events import EVENTS
from app.simulator.params import Value
from app.simulator.wire import Cmd, Mode, Result
from tests.support.breaching_vehicle import INCLUSION, northwards
from tests.support.simulated_vehicle import NAN, GroundStation

OUTSIDE = "Reposition is outside geofence"
EVENT = EVENTS["navigator_reposition_outside_geofence"][0]


def go(gcs: GroundStation, north_m: float, up_m: float = 15.0, command: int = Cmd.DO_REPOSITION) -> list[int]:
    frame = gcs.vehicle.spec.frame
    latitude, longitude = frame.to_global(north_m, 0.0)
    flags = (-1, 1, 0, NAN) if command == Cmd.DO_REPOSITION else (40, 0, 0, 0)
    return gcs.command(command, *flags, latitude, longitude, frame.altitude_m + up_m)


@pytest.mark.parametrize(
    ("params", "north_m", "up_m"),
    [({}, 120.0, 15.0), ({"GF_MAX_HOR_DIST": 30.0}, 35.0, 15.0), ({"GF_MAX_VER_DIST": 40.0}, 10.0, 50.0)],
)
def test_outside_it_is_accepted_and_said_and_the_vehicle_holds(
    params: dict[str, Value], north_m: float, up_m: float
) -> None:
    gcs = northwards(INCLUSION, **params)
    assert go(gcs, north_m, up_m) == [Result.ACCEPTED]
    assert OUTSIDE in gcs.texts()
    assert EVENT in [one.id for one in gcs.messages("EVENT")]
    gcs.fly(15.0)
    assert gcs.vehicle.state.status.mode is Mode.LOITER
    assert gcs.distance_to(15.0, 0.0) < 5.0
    assert abs(gcs.vehicle.state.body.up_m - 15.0) < 1.0


def test_inside_it_is_flown() -> None:
    gcs = northwards(INCLUSION)
    assert go(gcs, -30.0) == [Result.ACCEPTED]
    gcs.until(lambda: gcs.distance_to(-30.0, 0.0) < 1.0)
    assert OUTSIDE not in gcs.texts()


@pytest.mark.parametrize("action", [0, 1])
def test_a_fence_that_only_warns_refuses_no_place(action: int) -> None:
    gcs = northwards(INCLUSION, GF_ACTION=action)
    assert go(gcs, 120.0) == [Result.ACCEPTED]
    gcs.until(lambda: gcs.distance_to(120.0, 0.0) < 1.0)
    assert OUTSIDE not in gcs.texts()


def test_without_a_change_of_mode_it_is_for_a_vehicle_in_hold_alone() -> None:
    gcs = northwards(INCLUSION)
    assert gcs.command(Cmd.DO_REPOSITION, -1, 0, 0, NAN, NAN, NAN, NAN) == [Result.DENIED]
    assert gcs.vehicle.state.status.mode is Mode.MISSION
    gcs.set_mode(Mode.LOITER)
    assert gcs.command(Cmd.DO_REPOSITION, -1, 0, 0, NAN, NAN, NAN, NAN) == [Result.ACCEPTED]
