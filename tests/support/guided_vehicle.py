"""Tasks as the simulated vehicles fly them, in simulated time: how far beside the course, and that they end."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

from app.domain.autopilot.capability import FirmwareProfile, FlightKind
from app.domain.offboard.encode import Follower, encode
from app.domain.offboard.messages import LocalTarget
from app.domain.offboard.tasks.admission import course_of
from app.domain.offboard.tasks.course import CircleCourse, Course, LegsCourse
from app.domain.offboard.tasks.guidance import CRUISE_M_S, Fix, SetpointRequest, learnt_lag_s, stand, steer
from app.simulator.dialect import Message, mavlink
from tests.support.offboard_sender import Sender
from tests.support.task_examples import ORIGIN, task

KINDS = {"quad": FlightKind.ROTARY, "vtol": FlightKind.ROTARY, "plane": FlightKind.WING, "rover": FlightKind.ROVER}
UP_M = {"quad": 10.0, "vtol": 10.0, "plane": 50.0, "rover": 0.0}
TICK_S = 0.06
"""A whole number of the simulator's steps."""
LATE_TICKS = 2
"""A position is 0.06 s old when it is looked at; the guidance carries it forward."""
CORNER_M = 6.0


class Flight:
    """One vehicle and the guidance, tick by tick."""

    def __init__(self, airframe: str, wind: tuple[float, float] = (0.0, 0.0)) -> None:
        self.kind, self.up_m = KINDS[airframe], UP_M[airframe]
        self.sender = Sender(airframe).airborne(self.up_m)
        faults = self.sender.gcs.vehicle.faults
        faults.wind_north_m_s, faults.wind_east_m_s = wind
        self._measured: deque[Fix] = deque(maxlen=LATE_TICKS)

    @property
    def here(self) -> tuple[float, float]:
        return self.sender.place[0], self.sender.place[1]

    def fix(self) -> Fix:
        """What the guidance knows: a place that is late, carried forward."""
        body = self.sender.gcs.vehicle.state.body
        self._measured.append(Fix(self.here, body.up_m, (body.v_north_m_s, body.v_east_m_s)))
        return self._measured[0].ahead((len(self._measured) - 1) * TICK_S)

    def send(self, setpoint: Any) -> None:
        follower = Follower(self.kind, FirmwareProfile.FLOWN, ORIGIN.altitude_m)
        target = encode(setpoint, follower)
        assert isinstance(target, LocalTarget)
        self.sender.gcs.send(message(target))
        self.sender.gcs.fly(TICK_S)

    def stands(self, ground: tuple[float, float], seconds: float) -> None:
        for _ in range(round(seconds / TICK_S)):
            self.send(stand(self.kind, ground, self.up_m, self.fix()))

    def fly(self, course: Course, seconds: float, speed: float | None = None) -> list[float]:
        """Until it has arrived or so long; metres beside the course from where it was first joined, off corners."""
        beside: list[float] = []
        leg, lag_s = 0, 0.0
        for _ in range(round(seconds / TICK_S)):
            fix = self.fix()
            if self.kind is FlightKind.ROTARY:
                asked_m_s = speed or CRUISE_M_S[self.kind]
                lag_s = learnt_lag_s(lag_s, course, fix.ground, fix.velocity, asked_m_s, TICK_S)
            steering = steer(self.kind, SetpointRequest(course, self.up_m, leg, speed), fix, lag_s)
            leg = steering.reference.leg
            if steering.arrived:
                return beside
            self.send(steering.setpoint)
            cross_m = abs(course.reference(self.here, leg).cross_m)
            if not is_at_corner(course, self.here) and (beside or cross_m < 0.5):
                beside.append(cross_m)
        assert isinstance(course, CircleCourse), f"it must arrive within {seconds} s; it is at {self.here}"
        return beside


def is_at_corner(course: Course, here: tuple[float, float]) -> bool:
    return isinstance(course, LegsCourse) and min(math.dist(here, point) for point in course.points) < CORNER_M


def message(target: LocalTarget) -> Message:
    """As it goes over the wire."""
    return mavlink.MAVLink_set_position_target_local_ned_message(
        *(0, 1, 1, int(target.frame), int(target.type_mask)),
        *target.position,
        *target.velocity,
        *target.acceleration,
        *(target.yaw_rad, target.yaw_rate_rad_s),
    )


def course(kind: str, **fields: Any) -> Course:
    return course_of(task(kind, **fields), ORIGIN, 0.0)
