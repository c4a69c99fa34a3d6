"""When a VTOL changes state within a mission: what it does before, and what it does not begin until then."""

from __future__ import annotations

import math

import pytest

from app.simulator.wire import Cmd, VtolState
from tests.support.simulated_vehicle import GroundStation, Plan, do, land, takeoff, waypoint

EAST_UP = Plan(Cmd.NAV_VTOL_TAKEOFF, 0, 80, 20, (0, 0, 0, math.nan))
HOVER, FLY = do(Cmd.DO_VTOL_TRANSITION, 3), do(Cmd.DO_VTOL_TRANSITION, 4)


def state(gcs: GroundStation) -> VtolState:
    return VtolState(gcs.vehicle.state.status.vtol_state)


def yaw_deg(gcs: GroundStation) -> float:
    return math.degrees(gcs.vehicle.state.body.yaw_rad)


@pytest.mark.parametrize("tolerance_deg", [12.0, 3.0])
def test_after_its_takeoff_it_turns_to_its_point_and_then_becomes_a_plane(tolerance_deg: float) -> None:
    gcs = GroundStation("vtol", params={"MIS_YAW_ERR": tolerance_deg})
    gcs.start([EAST_UP, waypoint(0, 400, 20), land(command=Cmd.NAV_VTOL_LAND)])
    gcs.until(lambda: state(gcs) is VtolState.TRANSITION_TO_FW)
    assert yaw_deg(gcs) == pytest.approx(90.0, abs=tolerance_deg)
    assert gcs.vehicle.state.body.up_m > 19.0


def test_before_a_transition_item_it_turns_to_the_next_point() -> None:
    gcs = GroundStation("vtol")
    up = takeoff(15, 60, command=Cmd.NAV_VTOL_TAKEOFF)
    gcs.start([up, HOVER, waypoint(150, 0, 15, 2, 2), FLY, waypoint(0, 0, 15), land(command=Cmd.NAV_VTOL_LAND)])
    gcs.until(lambda: gcs.vehicle.store.current_seq == 3)
    gcs.until(lambda: state(gcs) is VtolState.TRANSITION_TO_FW)
    assert abs(yaw_deg(gcs)) == pytest.approx(180.0, abs=12.0)


def test_a_transition_item_lasts_until_the_vehicle_has_changed() -> None:
    gcs = GroundStation("vtol")
    up = takeoff(15, 60, command=Cmd.NAV_VTOL_TAKEOFF)
    gcs.start([up, waypoint(200, 0, 15), HOVER, waypoint(300, 0, 15, 2, 2), land(command=Cmd.NAV_VTOL_LAND)])
    gcs.until(lambda: gcs.vehicle.store.current_seq == 2)
    assert state(gcs) is not VtolState.MC
    gcs.until(lambda: gcs.vehicle.store.current_seq == 3)
    assert state(gcs) is VtolState.MC


def test_it_changes_back_before_it_lands() -> None:
    gcs = GroundStation("vtol")
    up = takeoff(15, 60, command=Cmd.NAV_VTOL_TAKEOFF)
    gcs.start([up, waypoint(200, 0, 15), land(command=Cmd.NAV_VTOL_LAND)])
    gcs.until(lambda: gcs.vehicle.store.current_seq == 2)
    assert state(gcs) is VtolState.FW
    gcs.until(lambda: gcs.vehicle.state.body.up_m < 12.0)
    assert state(gcs) is VtolState.MC
    assert gcs.distance_to(0, 0) < 11.0
