"""What the wind does to each type of vehicle; the dynamics alone."""

from __future__ import annotations

import math

import pytest

from app.simulator.airframe import AIRFRAMES
from app.simulator.clock import VehicleClock
from app.simulator.dynamics.factory import dynamics_for
from app.simulator.dynamics.model import Wind
from app.simulator.geo import LocalFrame
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint, SetpointKind
from app.simulator.state import Body, Status
from app.simulator.wire import VtolState

HIGH_M = 50.0


class Flight:
    """One body in the air, in a constant wind, without the rest of a vehicle."""

    def __init__(self, airframe: str, wind: Wind, *, speed_m_s: float = 0.0) -> None:
        self.body = Body(up_m=HIGH_M, v_north_m_s=speed_m_s)
        self.status = Status(armed=True)
        kind = AIRFRAMES[airframe]
        self.dynamics = dynamics_for(kind, Params(kind.params), self.status, LocalFrame(47.4, 8.5, 488.0))
        self.dynamics.reset(self.body)
        self.wind = wind
        self.setpoint = Setpoint(SetpointKind.LOITER, 0.0, 0.0, HIGH_M)

    def fly(self, seconds: float) -> Body:
        for _ in range(round(seconds / VehicleClock.STEP_S)):
            self.dynamics.step(self.body, self.setpoint, VehicleClock.STEP_S, self.wind)
        return self.body

    def to(self, north_m: float, east_m: float) -> Flight:
        self.setpoint = Setpoint(SetpointKind.POSITION, north_m, east_m, HIGH_M, previous=(0.0, 0.0))
        return self


@pytest.mark.parametrize(("north_m_s", "east_m_s"), [(6.0, 0.0), (0.0, -6.0)])
def test_a_multicopter_is_pushed_away_and_leans_against_the_wind_to_come_back(
    north_m_s: float, east_m_s: float
) -> None:
    """SIH's drag: 1 m/s2 for each m/s of wind."""
    flight = Flight("quad", Wind(north_m_s, east_m_s))
    body = flight.fly(1.0)
    assert body.north_m * north_m_s + body.east_m * east_m_s > 1.0, "pushed away"
    body = flight.fly(30.0)
    assert (body.north_m, body.east_m) == pytest.approx((0.0, 0.0), abs=0.5)
    assert math.hypot(body.pitch_rad, body.roll_rad) * 9.81 == pytest.approx(6.0, abs=0.3)


@pytest.fixture(scope="module")
def upwind() -> tuple[float, float, float]:
    """100 m against 6 m/s of wind and round a sharp corner: speed before it, seconds after it, the farthest north."""
    flight = Flight("quad", Wind(-6.0, 0.0))
    body = flight.fly(15.0)
    corner, end = (100.0, 0.0), (40.0, 60.0)
    flight.setpoint = Setpoint(SetpointKind.POSITION, *corner, HIGH_M, previous=(0.0, 0.0), next=end, next_up_m=HIGH_M)
    while math.dist((body.north_m, body.east_m), corner) > 10.0:
        flight.fly(VehicleClock.STEP_S)
    speed, seconds, northmost_m = body.ground_speed_m_s, 0.0, 0.0
    flight.setpoint = Setpoint(SetpointKind.POSITION, *end, HIGH_M, previous=corner, previous_up_m=HIGH_M)
    while math.dist((body.north_m, body.east_m), end) > 10.0:
        flight.fly(VehicleClock.STEP_S)
        seconds, northmost_m = seconds + VehicleClock.STEP_S, max(northmost_m, body.north_m)
    return speed, seconds, northmost_m


def test_against_the_wind_the_tilt_is_what_bounds_the_speed(upwind: tuple[float, float, float]) -> None:
    """Flown: 3.8 m/s; 45 degrees are 9.81 m/s2, and 6 of them hold the wind."""
    assert upwind[0] == pytest.approx(3.8, abs=0.1)


def test_a_corner_after_a_leg_at_the_tilt_limit_is_turned_without_a_stall(upwind: tuple[float, float, float]) -> None:
    """PX4's integrator unlearns what the tilt cannot give (tracking anti-windup), so the turn begins at once."""
    _, seconds, northmost_m = upwind
    assert northmost_m < 100.5, "it does not shoot over the corner"
    assert seconds < 20.5


@pytest.mark.parametrize("wind_m_s", [-5.0, 5.0])
def test_a_plane_keeps_its_airspeed_and_not_its_ground_speed(wind_m_s: float) -> None:
    body = Flight("plane", Wind(wind_m_s, 0.0), speed_m_s=12.0).to(5000.0, 0.0).fly(20.0)
    assert body.v_north_m_s == pytest.approx(12.0 * 0.99 + wind_m_s, abs=0.1)


def test_a_plane_crabs_to_stay_on_its_line() -> None:
    body = Flight("plane", Wind(0.0, 5.0), speed_m_s=12.0).to(5000.0, 0.0).fly(60.0)
    assert body.east_m == pytest.approx(0.0, abs=5.0)
    assert math.degrees(body.yaw_rad) == pytest.approx(-math.degrees(math.asin(5.0 / 11.9)), abs=2.0)


@pytest.mark.parametrize(("wind_m_s", "ground_speed_m_s"), [(-6.0, 4.0), (0.0, 10.0), (4.0, 14.0)])
def test_a_vtol_becomes_a_fixed_wing_by_its_airspeed(wind_m_s: float, ground_speed_m_s: float) -> None:
    """VT_ARSP_TRANS is 10 m/s."""
    flight = Flight("vtol", Wind(wind_m_s, 0.0))
    flight.dynamics.transition(VtolState.FW)
    for _ in range(500):
        flight.fly(VehicleClock.STEP_S)
        if flight.status.vtol_state == VtolState.FW:
            break
    assert flight.body.v_north_m_s == pytest.approx(ground_speed_m_s, abs=0.2)


@pytest.mark.parametrize(("north_m_s", "east_m_s"), [(2.0, 0.0), (0.0, 2.0), (-2.0, 1.0)])
def test_an_airship_drifts_with_the_wind(north_m_s: float, east_m_s: float) -> None:
    still, blown = (Flight("airship", wind).to(5000.0, 0.0).fly(20.0) for wind in (Wind(), Wind(north_m_s, east_m_s)))
    flown = (blown.v_north_m_s - north_m_s, blown.v_east_m_s - east_m_s)
    assert math.hypot(*flown) == pytest.approx(math.hypot(still.v_north_m_s, still.v_east_m_s), abs=0.01)
    assert math.hypot(blown.north_m - still.north_m, blown.east_m - still.east_m) > 20.0


def test_a_rover_stands_on_the_ground() -> None:
    still, blown = (Flight("rover", wind) for wind in (Wind(), Wind(0.0, 20.0)))
    bodies = []
    for flight in (still, blown):
        flight.body.up_m = 0.0
        bodies.append(flight.to(50.0, 0.0).fly(10.0))
    assert bodies[0] == bodies[1]
