"""How long a commanded speed lasts (scenario 22)."""

from __future__ import annotations

from app.simulator.dialect import mavlink
from app.simulator.wire import Cmd, Mode
from tests.support.simulated_vehicle import NAN, GroundStation, takeoff, waypoint

CHANGES_MODE = 1


def reposition(gcs: GroundStation, north_m: float, speed_m_s: float) -> None:
    x, y = (round(degrees * 1e7) for degrees in gcs.vehicle.spec.frame.to_global(north_m, 0.0))
    message = mavlink.MAVLink_command_int_message(
        1, 1, 0, Cmd.DO_REPOSITION, 0, 0, speed_m_s, CHANGES_MODE, 0, NAN, x, y, NAN
    )
    gcs.send(message)


def fastest_m_s(gcs: GroundStation, seconds: float) -> float:
    found = 0.0
    for _ in range(round(seconds / 0.1)):
        gcs.fly(0.1)
        found = max(found, gcs.vehicle.state.body.ground_speed_m_s)
    return found


def hovering() -> GroundStation:
    gcs = GroundStation(params={"MIS_TAKEOFF_ALT": 15.0})
    gcs.set_mode(Mode.TAKEOFF)
    gcs.arm()
    gcs.until(lambda: gcs.vehicle.state.status.mode is Mode.LOITER, 60.0)
    return gcs


def test_a_repositions_speed_is_for_that_way_only() -> None:
    gcs = hovering()
    reposition(gcs, 60.0, 2.0)
    assert 1.0 < fastest_m_s(gcs, 8.0) <= 2.1
    reposition(gcs, 90.0, -1.0)
    assert fastest_m_s(gcs, 8.0) > 3.5


def test_a_changed_speed_ends_with_the_mode() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(15), waypoint(300, 0, 15)])
    gcs.until(lambda: gcs.vehicle.store.current_seq == 1)
    gcs.command(Cmd.DO_CHANGE_SPEED, 1, 2, -1)
    assert fastest_m_s(gcs, 8.0) <= 2.1
    reposition(gcs, 120.0, -1.0)
    assert fastest_m_s(gcs, 8.0) > 3.5
