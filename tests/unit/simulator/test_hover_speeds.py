"""How fast a VTOL hovers: its wing pushes it down, and a speed lasts until it changes its state [27, 12]."""

from __future__ import annotations

import math

import pytest

from app.simulator.airframe import AIRFRAMES
from app.simulator.dynamics.hovering_wing import air_force
from app.simulator.wire import Cmd, VtolState
from tests.support.simulated_vehicle import GroundStation, Plan, do, land, takeoff, waypoint

CHANGE, TO_WING, TO_HOVER = Cmd.DO_CHANGE_SPEED, do(Cmd.DO_VTOL_TRANSITION, 4), do(Cmd.DO_VTOL_TRANSITION, 3)
LAND = land(command=Cmd.NAV_VTOL_LAND)


def speed_m_s(airframe: str, plans: list[Plan], seq: int, after_s: float) -> float:
    """Well into the leg to item `seq`."""
    gcs = GroundStation(airframe)
    gcs.start(plans)
    gcs.until(lambda: gcs.vehicle.store.current_seq == seq)
    gcs.fly(after_s)
    assert gcs.vehicle.store.current_seq == seq
    return gcs.vehicle.state.body.ground_speed_m_s


@pytest.mark.parametrize(
    ("asked_m_s", "airframe", "flown_m_s"),
    [(8.0, "vtol", 5.6), (2.0, "vtol", 1.7), (8.0, "quad", 7.6), (2.0, "quad", 2.0)],
)
def test_a_commanded_speed_in_hover(asked_m_s: float, airframe: str, flown_m_s: float) -> None:
    first = [takeoff(20)]
    if airframe == "vtol":
        first += [waypoint(0, 30, 20), TO_WING, waypoint(0, 200, 20), TO_HOVER] if asked_m_s > 5.0 else []
    plans = [*first, do(CHANGE, 1, asked_m_s, -1), waypoint(200, 200, 20), LAND if airframe == "vtol" else land()]
    assert speed_m_s(airframe, plans, len(first) + 1, 15.0) == pytest.approx(flown_m_s, rel=0.1)


def test_a_speed_set_on_the_wing_does_not_count_in_hover() -> None:
    plans = [takeoff(20), TO_WING, do(CHANGE, 0, 12, -1), waypoint(250, 0, 20), TO_HOVER, waypoint(450, 0, 20), LAND]
    assert speed_m_s("vtol", plans, 5, 12.0) == pytest.approx(4.9, abs=0.5)


def test_the_motors_that_the_wing_holds_down_cannot_keep_the_height() -> None:
    gcs = GroundStation("vtol")
    plans = [takeoff(30), TO_WING, waypoint(250, 0, 30), TO_HOVER, do(CHANGE, 1, 8, -1), waypoint(500, 0, 30), LAND]
    gcs.start(plans)
    gcs.until(lambda: gcs.vehicle.store.current_seq == 5)
    gcs.fly(20.0)
    assert gcs.vehicle.state.body.up_m == pytest.approx(28.1, abs=0.7)


@pytest.mark.parametrize("east_m", [0.0, -150.0])
def test_to_the_wing_from_a_hover_leg_it_stops_and_turns_first(east_m: float) -> None:
    gcs = GroundStation("vtol")
    gcs.start([takeoff(30), waypoint(80, 0, 30), TO_WING, waypoint(80 if east_m else 300, east_m, 30), LAND])
    gcs.until(lambda: gcs.vehicle.store.current_seq == 2)
    gcs.until(lambda: gcs.vehicle.state.status.vtol_state == VtolState.TRANSITION_TO_FW)
    began_s, speed = gcs.now_s, gcs.vehicle.state.body.ground_speed_m_s
    assert speed < (1.6 if east_m else 6.0)
    gcs.until(lambda: gcs.vehicle.state.status.vtol_state == VtolState.FW)
    assert gcs.now_s - began_s == pytest.approx(2.3, abs=0.4)


def test_back_to_hover_it_brakes_until_it_is_as_slow_as_it_hovers() -> None:
    gcs = GroundStation("vtol")
    gcs.start([takeoff(30), TO_WING, do(CHANGE, 0, 11, -1), waypoint(300, 0, 30), TO_HOVER, waypoint(500, 0, 30), LAND])
    gcs.until(lambda: gcs.vehicle.state.status.vtol_state == VtolState.TRANSITION_TO_MC)
    assert 0.4 < gcs.until(lambda: gcs.vehicle.state.status.vtol_state == VtolState.MC) < 0.8
    assert gcs.vehicle.state.body.ground_speed_m_s == pytest.approx(5.0, abs=0.2)


@pytest.mark.parametrize("pitch_deg", [-34.0, -20.0])
def test_nose_down_the_air_pushes_down_and_turns_the_nose_up(pitch_deg: float) -> None:
    pitch = math.radians(pitch_deg)
    force = air_force(5.6 * math.cos(pitch), 5.6 * math.sin(pitch))
    assert force.downward_m_s2 > 8.0
    assert force.nose_up_nm > 0.1


def test_a_vtol_has_its_own_limits() -> None:
    assert AIRFRAMES["vtol"].params["MPC_XY_VEL_MAX"] == 8.0
    assert AIRFRAMES["vtol"].params["MPC_XY_ERR_MAX"] == 5.0


def test_in_a_tail_wind_it_brakes_by_its_pitch() -> None:
    gcs = GroundStation("vtol")
    gcs.vehicle.faults.wind_north_m_s = 5.0
    gcs.start([takeoff(30), TO_WING, waypoint(300, 0, 30), TO_HOVER, waypoint(600, 0, 30), LAND])
    gcs.until(lambda: gcs.vehicle.state.status.vtol_state == VtolState.TRANSITION_TO_MC)
    assert gcs.until(lambda: gcs.vehicle.state.status.vtol_state == VtolState.MC) < 6.0
