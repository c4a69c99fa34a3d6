"""A multicopter's turn in the air beside what PX4 flew in scenario 15, and its bobbing before a landing in 25."""

from __future__ import annotations

import math

import pytest

from app.simulator.dynamics.model import Wind
from app.simulator.dynamics.multicopter import Multicopter
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint, SetpointKind
from app.simulator.state import Body, Status
from tests.support.simulated_vehicle import GroundStation, land, takeoff, waypoint

DT_S = 0.02


class Flight:
    """The dynamics alone, from a hover at 20 m."""

    def __init__(self) -> None:
        self.body = Body(up_m=20.0)
        self.seconds = 0.0
        self._quad = Multicopter(Params(), Status(), 0.5)
        self._quad.reset(self.body)

    def step(self, setpoint: Setpoint) -> Body:
        self._quad.step(self.body, setpoint, DT_S, Wind())
        self.seconds += DT_S
        return self.body


def leg(north_m: float, east_m: float, up_m: float, following: tuple[float, float]) -> Setpoint:
    return Setpoint(SetpointKind.POSITION, north_m, east_m, up_m, next=following, next_up_m=up_m)


@pytest.fixture(scope="module")
def swing() -> tuple[float, float, list[float]]:
    """Northmost place, seconds to the next waypoint's radius, ground speed each second: after an upload in flight."""
    flight = Flight()
    first = leg(149.9, 0.0, 20.0, (149.9, 99.9))
    while flight.step(first).north_m < 40.2:
        pass
    flight.seconds, northmost_m, speeds = 0.0, 0.0, []
    second = leg(0.0, 60.0, 25.0, (60.0, 60.0))
    while math.dist((flight.body.north_m, flight.body.east_m), (0.0, 60.0)) > 10.0:
        body = flight.step(second)
        northmost_m = max(northmost_m, body.north_m)
        if len(speeds) < flight.seconds:
            speeds.append(body.ground_speed_m_s)
    return northmost_m, flight.seconds, speeds


def test_a_turn_swings_out_seven_metres(swing: tuple[float, float, list[float]]) -> None:
    assert swing[0] == pytest.approx(47.2, abs=1.0)


def test_the_leg_after_a_turn_is_slow(swing: tuple[float, float, list[float]]) -> None:
    """19.1 s for 72 m: 2.1 m/s amid the turn, and never the cruise of 5 m/s after it."""
    _, seconds, speeds = swing
    assert seconds == pytest.approx(19.1, abs=1.5)
    assert min(speeds) < 2.3
    assert max(speeds[6:]) < 4.9


def test_the_cruise_speed_is_reached_slowly_because_the_climb_looked_like_weight() -> None:
    """Scenario 15: 3.9 m/s after 12 m, 4.2 m/s after 22 m, 4.5 m/s after 38 m; a level vehicle is faster by then."""
    speeds = {}
    for climbed in (False, True):
        flight = Flight()
        if climbed:
            up = Setpoint(SetpointKind.TAKEOFF, 0.0, 0.0, 40.0)
            while flight.step(up).up_m < 39.2:
                pass
        ahead = leg(149.9, 0.0, flight.body.up_m, (149.9, 99.9))
        speeds[climbed] = []
        for north_m in (12.0, 22.0, 38.0):
            while flight.step(ahead).north_m < north_m:
                pass
            speeds[climbed].append(flight.body.ground_speed_m_s)
    assert speeds[True] == pytest.approx([3.9, 4.2, 4.5], abs=0.2)
    assert speeds[False][0] > speeds[True][0] + 0.1


def test_the_waypoint_before_a_landing_is_passed_bobbing() -> None:
    """Scenario 25: 10.6, 9.3, 10.9 m at a waypoint of 10 m, because the way goes on at another height."""
    gcs = GroundStation()
    gcs.start([takeoff(10), waypoint(20, 0, 10), land(20)])
    gcs.until(lambda: gcs.vehicle.store.current_seq == 1)
    heights = []
    while gcs.vehicle.store.current_seq == 1:
        gcs.step()
        heights.append(gcs.vehicle.state.body.up_m)
    assert max(heights) == pytest.approx(10.6, abs=0.3)
    assert min(heights[heights.index(max(heights)) :]) == pytest.approx(9.3, abs=0.3)
