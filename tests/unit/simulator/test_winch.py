"""The winch as an external payload: a component of its own that acknowledges by itself."""

from __future__ import annotations

import pytest

from app.simulator.dialect import mavlink
from app.simulator.wire import Cmd, Result
from tests.unit.simulator.cockpit import RETURN, Cockpit, do, takeoff, waypoint


def winch(cockpit: Cockpit, *params: float, component: int = 169, wait_s: float = 30.0) -> list[int]:
    mark = len(cockpit.heard)
    p = [*params, *[0.0] * (7 - len(params))]
    cockpit.send(mavlink.MAVLink_command_long_message(1, component, Cmd.DO_WINCH, 0, *p))
    cockpit.fly(wait_s)
    return [h.message.result for h in cockpit.heard[mark:] if h.name == "COMMAND_ACK" and h.component == 169]


def test_a_winch_is_a_component_of_its_own_that_delivers_and_acknowledges() -> None:
    cockpit = Cockpit(winch=True)
    assert 169 in {heard.component for heard in cockpit.heard if heard.name == "HEARTBEAT"}
    assert winch(cockpit, 1, 4, 8.0, 2.0) == [Result.IN_PROGRESS, Result.ACCEPTED]
    assert cockpit.vehicle.winch is not None
    assert cockpit.vehicle.winch.delivered
    assert cockpit.last("WINCH_STATUS").line_length == pytest.approx(0.0)


def test_a_winch_lets_out_cancels_and_refuses() -> None:
    cockpit = Cockpit(winch=True)
    assert winch(cockpit, 1, 1, 10.0, 1.0, wait_s=2.0) == [Result.IN_PROGRESS]
    assert winch(cockpit, 1, 3) == [Result.CANCELLED, Result.ACCEPTED]
    assert cockpit.last("WINCH_STATUS").line_length == pytest.approx(2.0, abs=0.3)
    assert winch(cockpit, 1, 77) == [Result.DENIED]
    assert cockpit.vehicle.winch is not None
    cockpit.vehicle.winch.stuck = True
    assert winch(cockpit, 1, 6) == [Result.FAILED]


def test_the_autopilot_itself_does_not_know_winches_but_its_mission_reaches_one() -> None:
    cockpit = Cockpit(winch=True, params={"MIS_COMMAND_TOUT": 20.0})
    assert cockpit.command(Cmd.DO_WINCH, 1, 4) == [Result.UNSUPPORTED]
    cockpit.start([takeoff(10), waypoint(15, 0, 10, 2, 1), do(Cmd.DO_WINCH, 1, 4, 8.0, 2.0), RETURN])
    cockpit.until(lambda: cockpit.vehicle.winch is not None and cockpit.vehicle.winch.delivered)
    assert cockpit.distance_to(15, 0) < 1.5
