"""From a course to the setpoint of this moment: along it, and back to it, in the forms that the vehicle follows.

What hovers or drives gets a velocity: along the course, plus a share of the way to its nearest point and, round a
circle, what makes up for its lag, never more than the task's speed. A wing gets that point and the tangent there, which
its own path control follows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Final

from pydantic import ValidationError

from app.domain.autopilot.capability import FlightKind
from app.domain.errors import SetpointRefusedError
from app.domain.offboard.limits import OffboardLimits
from app.domain.offboard.setpoints import PositionNed, PositionVelocityNed, Setpoint, VelocityNed
from app.domain.offboard.tasks.course import (
    CORNERS,
    CircleCourse,
    Course,
    Ground,
    LegsCourse,
    PointCourse,
    Reference,
    Turn,
)

# Makes up for a hovering vehicle's lag in a turn: an aim inside the circle, as far as its flight shows it to need.
#
# PX4 follows a velocity that turns late: the integrator of its velocity loop carries the drag, and turns with the
# course. How late depends on gains, drag, speed and radius, so it is learnt: while it stays outside, the aim moves
# inwards.


BACK_PER_S: Final = 1.5
"""The fraction of the cross-track error that a hovering vehicle corrects per second."""
SHORTEST_LAG_S: Final = -0.5
LONGEST_LAG_S: Final = 2.0
LEARNT_PER_S2: Final = 0.6
LEARNS_WITHIN_M: Final = 3.0
"""Farther away it still joins the circle, and its distance says nothing of a lag."""
LONGEST_STEP_S: Final = 0.2


def inwards_m_s(lag_s: float, speed_m_s: float, radius_m: float) -> float:
    """The velocity that the course's own gains in `lag_s` by its centripetal acceleration; at most half the speed."""
    lag_s = max(SHORTEST_LAG_S, min(LONGEST_LAG_S, lag_s))
    most = speed_m_s / 2.0
    return max(-most, min(most, lag_s * speed_m_s**2 / radius_m))


def learnt_lag_s(
    lag_s: float, course: Course, here: Ground, velocity: Ground, speed_m_s: float, seconds: float
) -> float:
    """Return the lag after `seconds` at this position with this velocity. If the vehicle flies as commanded, it does
    not change.

    Courses other than circles have no lag.
    """
    if not isinstance(course, CircleCourse):
        return 0.0
    radius_m, away_m = abs(course.radius_m), math.dist(here, course.center)
    outside_m = away_m - radius_m
    if abs(outside_m) > LEARNS_WITHIN_M or away_m == 0.0:
        return lag_s
    out = ((here[0] - course.center[0]) / away_m, (here[1] - course.center[1]) / away_m)
    stays_m = outside_m + (out[0] * velocity[0] + out[1] * velocity[1]) / BACK_PER_S
    stays_m = max(-LEARNS_WITHIN_M, min(LEARNS_WITHIN_M, stays_m))
    gained_m_s = LEARNT_PER_S2 * stays_m * min(seconds, LONGEST_STEP_S)
    return max(SHORTEST_LAG_S, min(LONGEST_LAG_S, lag_s + gained_m_s * radius_m / speed_m_s**2))


CRUISE_M_S: Final = {FlightKind.ROTARY: 5.0, FlightKind.WING: 15.0, FlightKind.ROVER: 1.5, FlightKind.AIRSHIP: 0.0}
"""Of a task that names no speed. A wing flies its own; there it only says how soon it must turn."""
LEAD_S: Final = {FlightKind.ROTARY: 0.4, FlightKind.WING: 1.0, FlightKind.ROVER: 0.2, FlightKind.AIRSHIP: 0.0}
"""A vehicle follows this much late: the course is looked at from where it will be."""
CROSS_GAIN_PER_S: Final = {FlightKind.ROTARY: BACK_PER_S, FlightKind.ROVER: 0.9}
SLOWING_PER_S: Final = 0.4
"""So it never leads, in the limiter's LOOK_AHEAD_S, beyond the place where it ends; the climb neither."""
FASTEST_M_S: Final = 150.0
"""The maximum speed of a task; the speed of a moving target is added, and a setpoint allows 200 m/s."""
SLOWEST_M_S: Final = 0.5
"""At a corner that is not the end."""
CLIMB_GAIN_PER_S: Final = 0.45
CLIMB_M_S: Final = 2.0
DESCEND_M_S: Final = 1.5
ARRIVED_M: Final = 0.4
ROVER_ARRIVED_M: Final = 1.0
"""PX4 stops a rover at NAV_ACC_RAD, 0.5 m by default (AckermannPosControl), and it rolls on a little."""
ARRIVED_UP_M: Final = 0.5
RESTS_M_S: Final = 0.3
"""A faster rover would stop beside the point once it gets no more setpoints."""
BESIDE_M: Final = 1.0
"""So near a target that moves counts as reached."""
NEAR_M: Final = 2.0
"""Within this distance a fixed point is sent as a position: the vehicle brakes and holds by itself."""
WING_SWITCH_S: Final = 2.24
"""PX4's switch distance of a fixed wing (NPFG, default parameters), as a time at its speed."""
WING_LOITER_M: Final = 80.0
"""NAV_LOITER_RAD's default: what a wing flies round a place where it is to stay."""


@dataclass(frozen=True, slots=True)
class Fix:
    """Where the vehicle is and how it moves; `up_m` above the EKF origin."""

    ground: Ground
    up_m: float
    velocity: Ground

    def ahead(self, seconds: float) -> Fix:
        north, east = (place + speed * seconds for place, speed in zip(self.ground, self.velocity, strict=True))
        return replace(self, ground=(north, east))


@dataclass(frozen=True, slots=True)
class VerticalSpeeds:
    """How fast a task climbs and descends at most."""

    climb_m_s: float = CLIMB_M_S
    descend_m_s: float = DESCEND_M_S

    @classmethod
    def within(cls, limits: OffboardLimits) -> VerticalSpeeds:
        """No faster than these allow."""
        climb, descend = limits.max_climb_m_s, limits.max_descend_m_s
        return cls(min(CLIMB_M_S, climb or math.inf), min(DESCEND_M_S, descend or math.inf))


@dataclass(frozen=True, slots=True)
class SetpointRequest:
    """What a task requests from the guidance."""

    course: Course
    up_m: float
    leg: int = 0
    speed_m_s: float | None = None
    yaw_deg: float | None = None
    stays: bool = False
    vertical: VerticalSpeeds = field(default_factory=VerticalSpeeds)


@dataclass(frozen=True, slots=True)
class Steering:
    """The setpoint, where on the course the vehicle is, and whether it has come to the course's end."""

    setpoint: Setpoint
    reference: Reference
    arrived: bool


def steer(kind: FlightKind, request: SetpointRequest, fix: Fix, lag_s: float = 0.0) -> Steering:
    """Return the current setpoint. A fixed wing that stays at a point circles it. `lag_s`: learnt for a hovering
    vehicle.

    Raises:
        SetpointRefusedError: the point is outside the range of a setpoint, as a moving target can become.
    """
    speed = request.speed_m_s or CRUISE_M_S[kind]
    turn = Turn(WING_SWITCH_S * speed, math.inf) if kind is FlightKind.WING else CORNERS
    seen = request.course.reference(fix.ground, request.leg, turn)
    arrived = has_arrived(kind, request, fix, seen, turn)
    course = request.course
    if kind is FlightKind.WING and isinstance(course, PointCourse) and request.stays:
        course = CircleCourse(course.point, WING_LOITER_M)
    ahead = fix.ahead(LEAD_S[kind])
    aim = course.reference(ahead.ground, seen.leg, turn)
    try:
        if kind is FlightKind.WING:
            return Steering(_path_point(aim, request.up_m, speed), seen, arrived)
        return Steering(_velocity(kind, request, aim, ahead, speed, lag_s), seen, arrived)
    except ValidationError:
        raise SetpointRefusedError("it leads farther than a setpoint can say", refusal="limit.distance") from None


def stand(kind: FlightKind, ground: Ground, up_m: float, fix: Fix, vertical: VerticalSpeeds | None = None) -> Setpoint:
    """To stay at a place; a wing circles it. Raises SetpointRefusedError."""
    request = SetpointRequest(PointCourse(ground), up_m, stays=True, vertical=vertical or VerticalSpeeds())
    return steer(kind, request, fix).setpoint


def has_arrived(kind: FlightKind, request: SetpointRequest, fix: Fix, seen: Reference, turn: Turn) -> bool:
    """Whether the end of the course is reached; a circle has none."""
    course = request.course
    if isinstance(course, CircleCourse):
        return False
    is_last = not isinstance(course, LegsCourse) or seen.leg == course.last_leg
    if kind is FlightKind.WING:
        return is_last and seen.remaining_m <= turn.before_m
    if isinstance(course, PointCourse):
        is_at_height = kind is FlightKind.ROVER or abs(fix.up_m - request.up_m) <= ARRIVED_UP_M
        if course.velocity != (0.0, 0.0):
            return seen.remaining_m <= BESIDE_M and is_at_height
        return is_at_height and _rests_at(kind, course.point, fix)
    return is_last and _rests_at(kind, course.points[-1], fix)


def _rests_at(kind: FlightKind, place: Ground, fix: Fix) -> bool:
    near_m = ROVER_ARRIVED_M if kind is FlightKind.ROVER else ARRIVED_M
    return math.dist(fix.ground, place) <= near_m and math.hypot(*fix.velocity) <= RESTS_M_S


def _path_point(aim: Reference, up_m: float, speed_m_s: float) -> Setpoint:
    north, east = aim.tangent if aim.tangent != (0.0, 0.0) else (1.0, 0.0)
    return PositionVelocityNed(
        type="position_velocity_ned",
        north_m=aim.nearest[0],
        east_m=aim.nearest[1],
        down_m=-up_m,
        north_m_s=north * speed_m_s,
        east_m_s=east * speed_m_s,
    )


def _velocity(
    kind: FlightKind, request: SetpointRequest, aim: Reference, fix: Fix, speed_m_s: float, lag_s: float
) -> Setpoint:
    course, is_rover = request.course, kind is FlightKind.ROVER
    end = _stands_at(course, aim.leg)
    if end is not None and math.dist(fix.ground, end) <= NEAR_M:
        return PositionNed(
            type="position_ned",
            north_m=end[0],
            east_m=end[1],
            down_m=None if is_rover else -request.up_m,
            yaw_deg=request.yaw_deg,
        )
    north, east = _over_ground(kind, course, aim, fix, speed_m_s, lag_s)
    missing_m = request.up_m - fix.up_m
    most = request.vertical
    climb = 0.0 if is_rover else max(-most.descend_m_s, min(most.climb_m_s, CLIMB_GAIN_PER_S * missing_m))
    yaw_deg = None if is_rover else request.yaw_deg
    return VelocityNed(type="velocity_ned", north_m_s=north, east_m_s=east, down_m_s=-climb, yaw_deg=yaw_deg)


def _stands_at(course: Course, leg: int) -> Ground | None:
    """Where the course ends, if anywhere. A path's end is that of its last leg: on an earlier one it only passes."""
    if isinstance(course, LegsCourse):
        return course.points[-1] if leg == course.last_leg else None
    return course.point if isinstance(course, PointCourse) and course.velocity == (0.0, 0.0) else None


def _over_ground(kind: FlightKind, course: Course, aim: Reference, fix: Fix, speed_m_s: float, lag_s: float) -> Ground:
    along = min(speed_m_s, _slow_enough(aim, speed_m_s))
    if isinstance(course, PointCourse):
        sum_m_s = aim.tangent[0] * along + course.velocity[0], aim.tangent[1] * along + course.velocity[1]
        return _bounded(sum_m_s, FASTEST_M_S)
    gain = CROSS_GAIN_PER_S[kind]
    back = gain * (aim.nearest[0] - fix.ground[0]), gain * (aim.nearest[1] - fix.ground[1])
    if isinstance(course, CircleCourse):
        share = inwards_m_s(lag_s, speed_m_s, abs(course.radius_m)) / abs(course.radius_m)
        back = (
            back[0] + share * (course.center[0] - aim.nearest[0]),
            back[1] + share * (course.center[1] - aim.nearest[1]),
        )
    north, east = _bounded(back, speed_m_s)
    along = min(along, math.sqrt(max(0.0, speed_m_s**2 - north**2 - east**2)))
    return _bounded((aim.tangent[0] * along + north, aim.tangent[1] * along + east), speed_m_s)


def _bounded(velocity: Ground, speed_m_s: float) -> Ground:
    speed = math.hypot(*velocity)
    return velocity if speed <= speed_m_s else (velocity[0] * speed_m_s / speed, velocity[1] * speed_m_s / speed)


def _slow_enough(aim: Reference, speed_m_s: float) -> float:
    """Slow enough for the next corner; a right angle nearly requires a stop."""
    if aim.to_corner_m == math.inf:
        return speed_m_s
    slow = max(SLOWEST_M_S, speed_m_s * aim.corner_share) if aim.remaining_m > aim.to_corner_m else 0.0
    return slow + SLOWING_PER_S * aim.to_corner_m
