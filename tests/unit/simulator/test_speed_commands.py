"""How long a commanded speed lasts (scenario 22)."""

from __future__ import annotations

from app.simulator.dialect import mavlink
from app.simulator.wire import Cmd, Mode
from tests.support.simulated_vehicle import NAN, Cockpit, takeoff, waypoint

CHANGES_MODE = 1


def reposition(cockpit: Cockpit, north_m: float, speed_m_s: float) -> None:
    x, y = (round(degrees * 1e7) for degrees in cockpit.vehicle.spec.frame.to_global(north_m, 0.0))
    message = mavlink.MAVLink_command_int_message(
        1, 1, 0, Cmd.DO_REPOSITION, 0, 0, speed_m_s, CHANGES_MODE, 0, NAN, x, y, NAN
    )
    cockpit.send(message)


def fastest_m_s(cockpit: Cockpit, seconds: float) -> float:
    found = 0.0
    for _ in range(round(seconds / 0.1)):
        cockpit.fly(0.1)
        found = max(found, cockpit.vehicle.state.body.ground_speed_m_s)
    return found


def hovering() -> Cockpit:
    cockpit = Cockpit(params={"MIS_TAKEOFF_ALT": 15.0})
    cockpit.set_mode(Mode.TAKEOFF)
    cockpit.arm()
    cockpit.until(lambda: cockpit.vehicle.state.status.mode is Mode.LOITER, 60.0)
    return cockpit


def test_a_repositions_speed_is_for_that_way_only() -> None:
    cockpit = hovering()
    reposition(cockpit, 60.0, 2.0)
    assert 1.0 < fastest_m_s(cockpit, 8.0) <= 2.1
    reposition(cockpit, 90.0, -1.0)
    assert fastest_m_s(cockpit, 8.0) > 3.5


def test_a_changed_speed_ends_with_the_mode() -> None:
    cockpit = Cockpit()
    cockpit.start([takeoff(15), waypoint(300, 0, 15)])
    cockpit.until(lambda: cockpit.vehicle.store.current_seq == 1)
    cockpit.command(Cmd.DO_CHANGE_SPEED, 1, 2, -1)
    assert fastest_m_s(cockpit, 8.0) <= 2.1
    reposition(cockpit, 120.0, -1.0)
    assert fastest_m_s(cockpit, 8.0) > 3.5
