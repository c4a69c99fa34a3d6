"""PX4's altitude first order hold: a fixed wing climbs along its leg, not at once."""

from __future__ import annotations

import math

import pytest

from app.simulator.airframe import AIRFRAMES
from app.simulator.clock import VehicleClock
from app.simulator.dynamics.fixed_wing import FixedWing
from app.simulator.dynamics.model import Wind
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint, SetpointKind
from app.simulator.state import Body
from tests.support.simulated_vehicle import GroundStation, takeoff, waypoint

SWITCH_M = 30.0


def leg(length_m: float, ramp_to_m: float = SWITCH_M) -> Setpoint:
    """From 50 m to 80 m of height."""
    return Setpoint(
        SetpointKind.POSITION, length_m, 0.0, 80.0, previous=(0.0, 0.0), previous_up_m=50.0, ramp_to_m=ramp_to_m
    )


def height_after(setpoint: Setpoint, north_m: float) -> float:
    """Of a plane that begins the leg at 50 m, there or after the time for it: past its end a leg is flown back to."""
    body, wing = Body(up_m=50.0, v_north_m_s=12.0), FixedWing(Params(AIRFRAMES["plane"].params))
    wing.reset(body)
    for _ in range(round(north_m / 10.0 / VehicleClock.STEP_S)):
        if body.north_m >= north_m:
            break
        wing.step(body, setpoint, VehicleClock.STEP_S, Wind())
    return body.up_m


@pytest.mark.parametrize(("north_m", "up_m"), [(250.0, 57.7), (500.0, 65.5), (960.0, 79.8), (1500.0, 80.0)])
def test_it_climbs_along_the_leg_to_its_height_at_the_switch_distance_and_keeps_it(north_m: float, up_m: float) -> None:
    assert height_after(leg(1000.0), north_m) == pytest.approx(up_m, abs=2.0)


@pytest.mark.parametrize("setpoint", [leg(1000.0, math.nan), leg(79.0)])
def test_without_a_ramp_or_on_a_leg_shorter_than_a_loiter_it_climbs_at_once(setpoint: Setpoint) -> None:
    assert height_after(setpoint, 250.0) > 75.0


def test_a_mission_ramps_from_waypoint_to_waypoint_and_not_from_its_takeoff() -> None:
    gcs = GroundStation("plane", params={"MIS_TKO_LAND_REQ": 0})
    gcs.start([takeoff(30, north_m=200.0), waypoint(500, 0, 30), waypoint(1300, 0, 60)])
    setpoint, store = gcs.vehicle.context.setpoint, gcs.vehicle.store
    for seq, ramps in ((1, False), (2, True)):
        gcs.until(lambda seq=seq: store.current_seq == seq)
        assert math.isfinite(setpoint.ramp_to_m) is ramps
    assert (setpoint.previous_up_m, setpoint.up_m) == (30.0, 60.0)
