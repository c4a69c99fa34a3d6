"""Tasks flown by commands, as the simulated plane flies them in simulated time: how far beside, and when alone."""

from __future__ import annotations

import math
from functools import cache

import pytest

from app.domain.autopilot import behaviour_of
from app.domain.offboard.tasks.commanded import CIRCLE_HERE, CircleAt, FlyTo, Order, Wing, order, order_request
from app.domain.offboard.tasks.course import CircleCourse, Course, EkfOrigin, LegsCourse
from app.domain.offboard.tasks.guidance import Fix, SetpointRequest
from app.domain.vehicle.state import FirmwareVersion, VehicleType
from app.simulator.dialect import mavlink
from app.simulator.wire import Cmd, Mode
from tests.support.simulated_vehicle import GroundStation

UP_M = 50.0
LOOK_S = 0.5
CORNER_M = 120.0
"""A right angle is flown round so widely."""
WAY = LegsCourse(((0.0, 0.0), (500.0, 0.0), (500.0, 500.0)))
FIRMWARE = {"px4-1.14": FirmwareVersion(1, 14, 3), "px4-1.13": FirmwareVersion(1, 13, 3)}


class Flight:
    """A plane in Hold after its takeoff, and the orders of a course."""

    def __init__(self, firmware: str, wind_east_m_s: float = 0.0) -> None:
        self.wing = Wing.of(80.0, behaviour_of(VehicleType.FIXED_WING, FIRMWARE[firmware]))
        self.gcs = GroundStation("plane", firmware=firmware, params={"MIS_TAKEOFF_ALT": 25.0})
        self.gcs.command(Cmd.DO_SET_MODE, 1, 4, 2)
        self.gcs.arm()
        self.gcs.until(lambda: self.mode is Mode.LOITER and self.fix().up_m > 15.0, 60.0)
        self.gcs.vehicle.faults.wind_east_m_s = wind_east_m_s
        frame = self.gcs.vehicle.spec.frame
        self.origin = EkfOrigin(frame.latitude_deg, frame.longitude_deg, frame.altitude_m)

    @property
    def mode(self) -> Mode:
        return self.gcs.vehicle.state.status.mode

    def fix(self) -> Fix:
        body = self.gcs.vehicle.state.body
        return Fix((body.north_m, body.east_m), body.up_m, (body.v_north_m_s, body.v_east_m_s))

    def give(self, wanted: Order) -> None:
        request = order_request(wanted, self.origin)
        assert request.place is not None
        p1, p2, p3, p4, _, _, z = request.params
        self.gcs.send(
            mavlink.MAVLink_command_int_message(1, 1, 0, request.command, 0, 0, p1, p2, p3, p4, *request.place, z)
        )

    def fly(self, course: Course, seconds: float) -> list[float]:
        """Until it has arrived or so long; metres beside the course, off corners, once it has joined it."""
        beside: list[float] = []
        before: Order | None = None
        leg = 0
        for _ in range(round(seconds / LOOK_S)):
            found = order(SetpointRequest(course, UP_M, leg), self.fix(), self.wing, before)
            leg = found.reference.leg
            if found.arrived:
                return beside
            if found.order != before:
                self.give(found.order)
                before = found.order
            self.gcs.fly(LOOK_S)
            here = self.fix().ground
            cross_m = abs(course.reference(here, leg).cross_m)
            near = isinstance(course, LegsCourse) and min(math.dist(here, one) for one in course.points) < CORNER_M
            if not near and (beside or cross_m < 3.0):
                beside.append(cross_m)
        return beside


@cache
def flown(firmware: str) -> Flight:
    return Flight(firmware, wind_east_m_s=5.0)


@pytest.mark.parametrize("firmware", sorted(FIRMWARE))
def test_legs_are_kept_within_a_few_metres_in_wind_and_end(firmware: str) -> None:
    flight = flown(firmware)
    beside = flight.fly(WAY, 200.0)
    assert len(beside) > 60
    assert max(beside) < 5.0
    assert sorted(beside)[len(beside) // 2] < 1.0
    assert flight.fix().up_m == pytest.approx(UP_M, abs=1.0)
    assert flight.mode is Mode.LOITER, "never in another mode"
    assert math.dist(flight.fix().ground, WAY.points[-1]) < 60.0, "it ends at its end"


def test_a_circle_is_one_order_and_is_kept() -> None:
    beside = flown("px4-1.14").fly(CircleCourse((200.0, 200.0), -60.0), 80.0)
    assert len(beside) > 40
    assert max(beside[10:]) < 6.0


def test_alone_it_flies_straight_to_the_place_and_joins_the_circle_around_it() -> None:
    """As recorded [22_reposition_plane]: straight until 160 m before the place, then onto the circle of 80 m."""
    flight = Flight("px4-1.14")
    flight.give(FlyTo((600.0, 0.0), UP_M))
    flight.gcs.fly(8.0)
    first = flight.fix()
    flight.gcs.until(lambda: math.dist(flight.fix().ground, (600.0, 0.0)) < 165.0, 120.0)
    here = flight.fix()
    straight = math.atan2(0.0 - first.ground[1], 600.0 - first.ground[0])
    assert math.atan2(here.velocity[1], here.velocity[0]) == pytest.approx(straight, abs=0.05)
    flight.gcs.fly(25.0)
    assert math.dist(flight.fix().ground, (600.0, 0.0)) == pytest.approx(80.0, abs=6.0)
    flight.give(CircleAt((600.0, 0.0), 120.0, UP_M))
    flight.gcs.fly(25.0)
    before = flight.fix().ground
    assert flight.gcs.command(int(CIRCLE_HERE.command), *CIRCLE_HERE.params) == [0]
    flight.gcs.fly(25.0)
    assert math.dist(flight.fix().ground, before) == pytest.approx(80.0, abs=15.0), "without a place: where it was"
    assert flight.mode is Mode.LOITER
