"""A direct return, without the flight: each stage, what ends it, and what is said."""

from __future__ import annotations

import math

import pytest

from app.simulator.mission.geofence import Geofence
from app.simulator.mission.item import Item
from app.simulator.navigator.return_mode import DirectReturn
from app.simulator.params import Value
from app.simulator.setpoint import SetpointKind
from app.simulator.state import Home
from app.simulator.wire import Cmd, VtolState
from tests.support.airborne_vehicle import GROUND_AMSL_M, Airborne, Place

GOAL = (200.0, 100.0)
"""Where they return to; home's ground is 5 m above that of the frame."""
AMONG: dict[str, Value] = {"RTL_RETURN_ALT": 45.0, "RTL_DESCEND_ALT": 25.0, "RTL_LOITER_RAD": 60.0}


class Returning:
    def __init__(
        self, airframe: str = "quad", at: Place = (0.0, 0.0, 20.0), fence: tuple[Item, ...] = (), **params: Value
    ) -> None:
        self.air = Airborne(airframe, at, **{**AMONG, **params})
        self.air.status.home = Home(0.0, 0.0, 5.0)
        self.fence = Geofence(fence, self.air.context.frame)
        self.way = DirectReturn(self.air.context, lambda: self.fence)
        self.way.start(GOAL)
        self.setpoint = self.air.context.setpoint

    def at(self, distance_m: float, up_m: float, steps: int = 1) -> tuple[SetpointKind, float]:
        """Kind and height of the setpoint after some cycles that far south of the goal."""
        self.air.place(GOAL[0] - distance_m, GOAL[1], up_m)
        self.air.run(self.way.step, 0.02 * steps)
        return self.setpoint.kind, self.setpoint.up_m

    def waiting(self) -> Returning:
        """Down at RTL_DESCEND_ALT, where the delay begins."""
        for up_m in (50.0, 50.0, 30.0):
            self.at(0.0, up_m)
        return self


CLIMB, HIGH, LOW = (SetpointKind.LOITER, 50.0), (SetpointKind.POSITION, 50.0), (SetpointKind.POSITION, 30.0)
LANDING = (SetpointKind.LAND, 5.0)


# stages -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("airframe", "tolerance_m"), [("quad", 0.8), ("plane", 10.0), ("vtol", 10.0)])
def test_it_climbs_where_it_is_to_within_the_tolerance_of_its_height(airframe: str, tolerance_m: float) -> None:
    returning = Returning(airframe)
    assert (returning.setpoint.kind, returning.setpoint.up_m, returning.setpoint.point) == (*CLIMB, (0.0, 0.0))
    assert returning.at(300.0, 50.0 - tolerance_m - 0.05) == CLIMB
    assert returning.setpoint.point == (0.0, 0.0)
    assert returning.at(300.0, 50.0 - tolerance_m + 0.05) == (CLIMB if airframe != "quad" else HIGH)
    assert returning.setpoint.point == GOAL


@pytest.mark.parametrize("radius_m", [60.0, -60.0])
def test_a_wing_circles_by_rtl_loiter_rad_and_its_sign(radius_m: float) -> None:
    returning = Returning("plane", at=(0.0, 0.0, 60.0), RTL_LOITER_RAD=radius_m)
    returning.at(300.0, 60.0)
    assert (returning.setpoint.loiter_radius_m, returning.setpoint.loiter_clockwise) == (60.0, radius_m > 0.0)


def test_a_multicopter_lands_from_its_height_within_nav_acc_rad() -> None:
    returning = Returning()
    returning.at(300.0, 50.0)
    assert returning.at(10.1, 50.0) == HIGH
    assert returning.at(9.9, 50.0) == LANDING
    assert returning.setpoint.point == GOAL


@pytest.mark.parametrize(("airframe", "tolerance_m"), [("plane", 5.0), ("vtol", 10.0)])
def test_a_wing_comes_down_on_its_orbit_before_it_lands(airframe: str, tolerance_m: float) -> None:
    """A plane asks for the height more exactly than a VTOL, which lands as a multicopter."""
    returning = Returning(airframe, RTL_LAND_DELAY=0.0)
    returning.at(300.0, 50.0)
    assert returning.at(70.1, 50.0) == CLIMB
    assert returning.at(69.9, 50.0) == (SetpointKind.LOITER, 30.0)
    assert returning.at(71.0, 30.0, 3) == (SetpointKind.LOITER, 30.0), "not there any more"
    for up_m in (30.0 + tolerance_m + 0.1, 30.0 - tolerance_m - 0.1):
        assert returning.at(60.0, up_m, 3) == (SetpointKind.LOITER, 30.0)
    returning.at(60.0, 30.0 + tolerance_m - 0.1, 3)
    assert returning.setpoint.kind is SetpointKind.POSITION


def test_nobody_climbs_to_rtl_descend_alt() -> None:
    returning = Returning(RTL_LAND_DELAY=9.0, RTL_DESCEND_ALT=70.0)
    returning.at(0.0, 50.0)
    assert returning.at(0.0, 50.0) == CLIMB


def test_a_delay_is_waited_low_over_the_goal_and_then_it_lands() -> None:
    returning = Returning(RTL_LAND_DELAY=20.0)
    returning.at(300.0, 50.0)
    assert returning.at(0.0, 50.0) == (SetpointKind.LOITER, 30.0)
    for up_m in (30.9, 29.1):
        returning.at(0.0, up_m, 3)
    returning.at(10.1, 30.0, 100)
    returning.at(0.0, 30.7)
    waited = returning.air.until(returning.way.step, lambda: returning.setpoint.kind is not SetpointKind.LOITER)
    assert waited == pytest.approx(20.0, abs=0.03)
    assert (returning.setpoint.kind, returning.setpoint.up_m) == LOW
    assert returning.at(10.1, 30.0) == LOW
    assert returning.at(9.9, 30.0) == LANDING


@pytest.mark.parametrize(("delay_s", "said"), [(-1.0, 1), (0.0, 0), (5.0, 0)])
def test_a_negative_delay_never_ends_and_is_said_once(delay_s: float, said: int) -> None:
    returning = Returning("plane", RTL_LAND_DELAY=delay_s)
    for up_m in (50.0, 50.0, 45.0):
        returning.at(0.0, up_m)
    assert "RTL: completed, loitering" not in returning.air.said, "not yet down"
    returning.waiting()
    returning.air.run(returning.way.step, 30.0)
    assert (returning.setpoint.kind is SetpointKind.LOITER) is (said == 1)
    assert returning.air.said.count("RTL: completed, loitering") == said
    assert returning.air.events.count(("rtl_completed_loiter",)) == said


def test_a_vtol_on_its_wing_changes_back_over_the_goal_and_waits_for_the_change() -> None:
    returning = Returning("vtol").waiting()
    air = returning.air
    assert returning.at(20.0, 30.0, 3) == LOW, "no orbit any more"
    assert air.issued == []
    returning.at(9.9, 30.0)
    assert air.issued == [(Cmd.DO_VTOL_TRANSITION, (3.0, 0.0, 0.0, 0.0))]
    assert returning.setpoint.kind is SetpointKind.POSITION
    air.status.vtol_state = VtolState.TRANSITION_TO_MC
    assert returning.at(0.0, 30.0, 5) == LOW
    air.status.vtol_state = VtolState.MC
    assert returning.at(11.0, 30.0, 3) == LOW
    assert returning.at(9.0, 30.0) == LANDING
    assert len(air.issued) == 1


@pytest.mark.parametrize("airframe", ["plane", "vtol"])
def test_nobody_else_changes_anything(airframe: str) -> None:
    returning = Returning(airframe, RTL_LAND_DELAY=0.0)
    if airframe == "vtol":
        returning.air.status.vtol_state = VtolState.MC
    returning.waiting()
    for _ in range(4):
        returning.at(0.0, 30.0)
    assert returning.setpoint.kind is SetpointKind.LAND
    assert returning.air.issued == []


def test_a_vtol_that_hovers_and_waits_lands_as_a_multicopter() -> None:
    returning = Returning("vtol", RTL_LAND_DELAY=2.0)
    returning.air.status.vtol_state = VtolState.MC
    returning.waiting()
    returning.air.run(returning.way.step, 3.0)
    assert (returning.setpoint.kind, returning.air.issued) == (SetpointKind.LAND, [])


# what is said -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("return_m", "amsl_m", "above_m"), [(45.0, 151, 45), (45.005, 151, 45), (45.6, 152, 46)])
def test_heights_are_said_in_whole_metres_rounded_up(return_m: float, amsl_m: int, above_m: int) -> None:
    air = Returning(RTL_RETURN_ALT=return_m).air
    assert air.said == [f"RTL: start return at {amsl_m} m ({above_m} m above destination)"]
    assert air.events == [("vrtl_return_at",)]


def test_the_landing_is_said_as_it_begins() -> None:
    returning = Returning()
    for up_m in (50.0, 50.0, 50.0):
        returning.at(0.0, up_m)
    assert returning.air.said[1:] == ["RTL: land at destination"]
    assert returning.air.events[1:] == [("rtl_land_at_destination",)]


def test_a_rover_says_its_landing_first() -> None:
    returning = Returning("rover")
    assert (returning.setpoint.kind, returning.setpoint.point) == (SetpointKind.LAND, GOAL)
    assert [text[:11] for text in returning.air.said] == ["RTL: land a", "RTL: start "]


def idles(air: Airborne) -> int:
    """How often the end was said; it is the same each time."""
    for command, params in air.issued:
        assert command == Cmd.IDLE
        assert params == pytest.approx((0.0, 10.0, 80.0, math.nan, 0.0, 0.0, GROUND_AMSL_M + 5.0), nan_ok=True)
    return len(air.issued)


def test_the_end_is_said_once_for_each_landing() -> None:
    returning = Returning()
    air, step = returning.air, returning.way.step
    for _ in range(3):
        returning.at(0.0, 50.0)
    assert idles(air) == 0
    air.land()
    air.run(step, 1.0)
    assert idles(air) == 1
    air.land(False)
    air.run(step, 1.0)
    air.land()
    air.run(step, 1.0)
    assert idles(air) == 2
    for again in (3, 4):
        returning.way.stand()
        air.run(step, 1.0)
        assert idles(air) == again


def test_a_second_return_is_said_to_end_too() -> None:
    """Not where it begins: a rover says for a moment that it has landed there."""
    rover = Returning("rover", NAV_ACC_RAD=10.0)
    rover.air.land()
    for flight in (1, 2):
        rover.at(11.0, 0.0, steps=50)
        assert idles(rover.air) == flight - 1
        rover.at(9.0, 0.0, steps=50)
        assert idles(rover.air) == flight
        rover.way.start(GOAL)


def test_who_stands_already_has_landed_at_homes_height() -> None:
    air = Airborne()
    air.status.home = Home(0.0, 0.0, 5.0)
    air.land()
    way = DirectReturn(air.context, lambda: Geofence((), air.context.frame))
    way.stand()
    air.run(way.step, 1.0)
    assert idles(air) == 1
    assert air.said == []
