"""Control of a fixed wing by commands: from a course to the current DO_REPOSITION or DO_ORBIT.

PX4 flies straight to the point of a DO_REPOSITION until it is within twice the loiter radius or the switch distance,
then joins the circle around it (flown on PX4 main; the source of v1.13 is the same). So a line is flown by a carrot: a
point on the course, so far ahead that the circle is never joined, and updated when necessary.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from app.domain.autopilot import Behaviour
from app.domain.autopilot.capability import FlightKind
from app.domain.geo import LocalProjection
from app.domain.mission import NAN, MavCmd
from app.domain.offboard.tasks.course import (
    CircleCourse,
    Course,
    EkfOrigin,
    Ground,
    LegsCourse,
    PointCourse,
    Reference,
    Turn,
    circle_around,
)
from app.domain.offboard.tasks.guidance import (
    CRUISE_M_S,
    WING_LOITER_M,
    WING_SWITCH_S,
    Fix,
    SetpointRequest,
    has_arrived,
)
from app.domain.vehicle.commands import CommandRequest

LOOK_AHEAD_S: Final = 4.0
"""The course leads back to the line at the point that is so long ahead."""
LEAD_S: Final = 0.5
"""An order is followed this much late."""
RENEWED_S: Final = 3.0
"""A carrot is valid for this time if the course does not change."""
SLOWEST_M_S: Final = 8.0
COURSE_OFF_RAD: Final = math.radians(1.5)
"""A carrot is updated when the course to it is off by more than this."""
UP_OFF_M: Final = 1.0
MOVED_M: Final = 5.0
"""A target that moved farther than this gets a new command."""


@dataclass(frozen=True, slots=True)
class FlyTo:
    """DO_REPOSITION: straight there, and then circle it with the vehicle's own radius."""

    ground: Ground
    up_m: float


@dataclass(frozen=True, slots=True)
class CircleAt:
    """DO_ORBIT: a positive radius clockwise."""

    center: Ground
    radius_m: float
    up_m: float


Order = FlyTo | CircleAt


@dataclass(frozen=True, slots=True)
class Wing:
    """What the vehicle brings along: its loiter radius, and how many seconds ahead its guidance switches."""

    loiter_m: float = WING_LOITER_M
    switch_s: float = WING_SWITCH_S

    @classmethod
    def of(cls, loiter_m: float | None, behaviour: Behaviour) -> Wing:
        """With the loiter radius that it is set to."""
        return cls(WING_LOITER_M if loiter_m is None else abs(loiter_m), behaviour.guidance_s)

    def joins_m(self, speed_m_s: float) -> float:
        """Nearer than this PX4 joins the circle around the place."""
        return 2.0 * max(self.loiter_m, self.switch_s * speed_m_s)

    def reach_m(self, speed_m_s: float) -> float:
        """Return how far ahead the carrot is."""
        return self.joins_m(speed_m_s) + RENEWED_S * speed_m_s


@dataclass(frozen=True, slots=True)
class Ordered:
    """The command that should be active now, the position on the course, and whether its end is reached."""

    order: Order
    reference: Reference
    arrived: bool


def order(request: SetpointRequest, fix: Fix, wing: Wing, before: Order | None) -> Ordered:
    """Return the current command for a course. `before`, the active one, is kept while it is good enough."""
    course = request.course
    speed = max(SLOWEST_M_S, math.hypot(*fix.velocity))
    turn = Turn(WING_SWITCH_S * speed, math.inf)
    seen = course.reference(fix.ground, request.leg, turn)
    if isinstance(course, CircleCourse):
        return Ordered(CircleAt(course.center, course.radius_m, request.up_m), seen, arrived=False)
    if isinstance(course, PointCourse):
        return Ordered(_to(course, request.up_m, before), seen, seen.remaining_m <= _on_circle_m(wing, speed))
    arrived = has_arrived(FlightKind.WING, request, fix, seen, turn)
    return Ordered(_carrot(course, request, fix.ahead(LEAD_S), speed, wing, before, seen.leg, turn), seen, arrived)


def outline(course: Course, wing: Wing) -> tuple[Ground, ...]:
    """Where it leads, and beyond each leg's end to the farthest carrot and round it: there it circles if we die."""
    if isinstance(course, PointCourse):
        return circle_around(course.point, wing.loiter_m)
    if isinstance(course, CircleCourse):
        return circle_around(course.center, abs(course.radius_m))
    found: tuple[Ground, ...] = ()
    reach_m = wing.reach_m(CRUISE_M_S[FlightKind.WING])
    for start, end in zip(course.points, course.points[1:], strict=False):
        share = reach_m / math.dist(start, end)
        beyond = (end[0] + (end[0] - start[0]) * share, end[1] + (end[1] - start[1]) * share)
        found = (*found, start, end, *circle_around(beyond, wing.loiter_m), end)
    return found


def _on_circle_m(wing: Wing, speed_m_s: float) -> float:
    """From here on it is on the circle around a place, or within the switch distance of it."""
    return max(WING_SWITCH_S * speed_m_s, wing.loiter_m * 1.2)


def _to(course: PointCourse, up_m: float, before: Order | None) -> Order:
    if isinstance(before, FlyTo) and math.dist(before.ground, course.point) < MOVED_M and _as_high(before, up_m):
        return before
    return FlyTo(course.point, up_m)


def _carrot(
    course: LegsCourse,
    request: SetpointRequest,
    fix: Fix,
    speed: float,
    wing: Wing,
    before: Order | None,
    leg: int,
    turn: Turn,
) -> Order:
    aim = course.reference(fix.ground, leg, turn)
    ahead_m = LOOK_AHEAD_S * speed
    wanted = tuple(
        at + along * ahead_m - here for at, along, here in zip(aim.nearest, aim.tangent, fix.ground, strict=True)
    )
    away_m = math.hypot(*wanted)
    if isinstance(before, FlyTo) and _as_high(before, request.up_m):
        there = (before.ground[0] - fix.ground[0], before.ground[1] - fix.ground[1])
        if math.hypot(*there) > wing.joins_m(speed) and _angle(there, (wanted[0], wanted[1])) < COURSE_OFF_RAD:
            return before
    share = max(1.0, wing.reach_m(speed) / away_m)
    return FlyTo((fix.ground[0] + wanted[0] * share, fix.ground[1] + wanted[1] * share), request.up_m)


def _as_high(before: FlyTo, up_m: float) -> bool:
    return abs(before.up_m - up_m) < UP_OFF_M


def _angle(one: Ground, other: Ground) -> float:
    cross, dot = one[0] * other[1] - one[1] * other[0], one[0] * other[0] + one[1] * other[1]
    return abs(math.atan2(cross, dot))


# Orders as commands: DO_REPOSITION and DO_ORBIT. Their altitude is above sea level whatever the frame says.


OWN_SPEED: Final = -1.0
CHANGE_MODE: Final = 1.0
"""MAV_DO_REPOSITION_FLAGS_CHANGE_MODE: to Hold, if it is in another mode."""
TIMEOUT_S: Final = 1.0
CIRCLE_HERE: Final = CommandRequest(
    MavCmd.DO_REPOSITION, (OWN_SPEED, CHANGE_MODE, NAN, NAN, NAN, NAN, NAN), timeout_s=TIMEOUT_S, attempts=1
)
"""Without a position PX4 circles at its current one. Changing the mode alone has no effect: in Hold it flies on to the
last point.

Sent once: before repeating it, check whether somebody else controls the vehicle.
"""


def order_request(order: Order, origin: EkfOrigin) -> CommandRequest:
    """Sent once: a newer order is better than the same again."""
    ground = order.center if isinstance(order, CircleAt) else order.ground
    latitude, longitude = LocalProjection(origin.latitude_deg, origin.longitude_deg).to_global(ground[1], ground[0])
    altitude_m = origin.altitude_m + order.up_m
    if isinstance(order, CircleAt):
        command, params = MavCmd.DO_ORBIT, (order.radius_m, NAN, NAN, NAN)
    else:
        command, params = MavCmd.DO_REPOSITION, (OWN_SPEED, CHANGE_MODE, NAN, NAN)
    return CommandRequest(
        command,
        (*params, NAN, NAN, altitude_m),
        timeout_s=TIMEOUT_S,
        attempts=1,
        place=(round(latitude * 1e7), round(longitude * 1e7)),
    )
