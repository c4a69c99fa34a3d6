"""How high a return flies, and how each vehicle type ends it."""

from __future__ import annotations

import pytest

from app.simulator.navigator.return_destination import ReturnDestination
from app.simulator.navigator.return_mode import ReturnMode
from app.simulator.setpoint import SetpointKind
from app.simulator.state import Home, LandDetected
from app.simulator.wire import VtolState
from tests.unit.simulator.cockpit import Cockpit


def returning(airframe: str, north_m: float, up_m: float, **params: float) -> tuple[Cockpit, ReturnMode]:
    cockpit = Cockpit(airframe, params=params, ready=False)
    vehicle = cockpit.vehicle
    vehicle.state.status.home = Home(0.0, 0.0, 0.0)
    vehicle.state.status.land = LandDetected(landed=False)
    vehicle.state.body.north_m, vehicle.state.body.up_m = north_m, up_m
    mode = ReturnMode(vehicle.context, ReturnDestination(vehicle.context, vehicle.store))
    mode.activate()
    return cockpit, mode


@pytest.mark.parametrize(
    ("north_m", "up_m", "params", "return_m"),
    [
        (100.0, 15.0, {}, 30.0),
        (100.0, 15.0, {"RTL_RETURN_ALT": 50.0}, 50.0),
        (100.0, 70.0, {}, 70.0),  # it never descends first
        (4.0, 3.0, {}, 8.0),  # inside NAV_ACC_RAD: twice the distance
        (4.0, 15.0, {}, 15.0),
        (25.0, 5.0, {"RTL_MIN_DIST": 40.0}, 25.0),  # inside RTL_MIN_DIST: the cone of 45 degrees
        (25.0, 5.0, {"RTL_MIN_DIST": 20.0}, 30.0),
        (15.0, 5.0, {"RTL_MIN_DIST": 40.0}, 20.0),  # at least twice NAV_ACC_RAD
    ],
)
def test_a_return_climbs_to_its_altitude_less_near_home(
    north_m: float, up_m: float, params: dict[str, float], return_m: float
) -> None:
    cockpit, _ = returning("quad", north_m, up_m, **params)
    assert cockpit.vehicle.context.setpoint.up_m == pytest.approx(return_m)


def arrived(airframe: str) -> Cockpit:
    cockpit, mode = returning(airframe, 0.0, 60.0)
    for _ in range(3):
        mode.step()
    return cockpit


def test_a_multicopter_lands() -> None:
    assert arrived("quad").vehicle.context.setpoint.kind is SetpointKind.LAND


def test_a_plane_circles_at_rtl_descend_alt() -> None:
    setpoint = arrived("plane").vehicle.context.setpoint
    assert (setpoint.kind, setpoint.up_m) == (SetpointKind.LOITER, 30.0)


def test_a_vtol_on_its_wing_changes_back_before_it_lands() -> None:
    cockpit, mode = returning("vtol", 0.0, 60.0)
    cockpit.vehicle.state.status.vtol_state = VtolState.FW
    for _ in range(3):
        mode.step()
    announced = [(message.command, message.param1) for message in cockpit.messages("COMMAND_LONG")]
    assert announced == [(3000, VtolState.MC)]
    assert cockpit.vehicle.context.setpoint.kind is SetpointKind.LAND
