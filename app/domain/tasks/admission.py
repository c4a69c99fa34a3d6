"""Which tasks are queued: those that this vehicle can fly, within the limits and the fence on board."""

from __future__ import annotations

import math
from typing import Final

from shapely import LineString, Point

from app.domain.errors import SetpointRefusedError, TaskRefusedError
from app.domain.setpoint.capability import FirmwareProfile, FlightKind, capability
from app.domain.setpoint.forms import MOST_METRES, PositionNed
from app.domain.setpoint.limiter import Whereabouts, limit
from app.domain.setpoint.limits import OffboardLimits
from app.domain.tasks.course import CircleCourse, Course, Ground, LegsCourse, PointCourse
from app.domain.tasks.forms import Circle, Goto, Segment, Task
from app.domain.tasks.guidance import WING_LOITER_M
from app.domain.tasks.origin import EkfOrigin

FORMS: Final = {
    FlightKind.ROTARY: ("velocity_ned", "position_ned"),
    FlightKind.ROVER: ("velocity_ned", "position_ned"),
    FlightKind.WING: ("position_velocity_ned",),
    FlightKind.AIRSHIP: ("velocity_ned",),
}
"""The setpoint forms that a task is flown with."""
WING_SMALLEST_M: Final = 30.0
"""The circle of a small wing at 15 m/s and 35 degrees of bank."""
SHORTEST_M: Final = 0.5
_CORNERS: Final = 24


def refuse_kind(kind: FlightKind, profile: FirmwareProfile) -> None:
    """Raises TaskRefusedError where the vehicle does not follow the setpoints of tasks; the code is the table's."""
    for form in FORMS[kind]:
        verdict = capability(form, kind, profile).verdict
        if not verdict.is_taken:
            raise TaskRefusedError(
                f"tasks are flown with {form}, which is not sent to a {kind.value}: {verdict.reason}",
                refusal=verdict.code,
                hint="send it there by a plan",
            )


def course_of(task: Task, origin: EkfOrigin, now_s: float) -> Course:
    """The task's course. Raises TaskRefusedError for a segment that leads nowhere."""
    if isinstance(task, Goto):
        moves = task.motion
        velocity = (0.0, 0.0) if moves is None else (moves.north_m_s, moves.east_m_s)
        return PointCourse(origin.ground(task.point), velocity, now_s)
    if isinstance(task, Circle):
        return CircleCourse(origin.ground(task.center), task.radius_m)
    points = (task.start, task.end) if isinstance(task, Segment) else task.points
    legs = _without_repeats(tuple(origin.ground(point) for point in points))
    if len(legs) >= 2:
        return LegsCourse(legs)
    if isinstance(task, Segment):
        raise TaskRefusedError(
            "the segment's start and end are the same place", refusal="tasks.no_length", hint="a goto leads to a place"
        )
    return PointCourse(legs[0])


def refuse_beyond(task: Task, course: Course, up_m: float | None, limits: OffboardLimits, where: Whereabouts) -> None:
    """Raises TaskRefusedError for what leads beyond a limit or the fence, or this kind cannot do."""
    if where.kind is FlightKind.WING:
        _refuse_for_wing(task, course)
    else:
        _refuse_too_fast(task, limits.max_speed_m_s)
    points = _outline(course, where.kind)
    _refuse_unsayable(points, up_m)
    strict = limits.model_copy(update={"beyond": "refuse"})
    if up_m is None:  # flown as high as it is then: the height is limited when it is flown
        strict = strict.model_copy(update={"min_altitude_m": None, "max_altitude_m": None})
    anywhere = Whereabouts(kind=where.kind, home=where.home, home_ned=where.home_ned)
    for north, east in points:
        down_m = 0.0 if up_m is None else -up_m
        setpoint = PositionNed(type="position_ned", north_m=north, east_m=east, down_m=down_m)
        try:
            limit(setpoint, strict, anywhere)
        except SetpointRefusedError as error:
            raise TaskRefusedError(error.detail, refusal=error.refusal) from None
    _refuse_beyond_fence(points, where)


def _refuse_too_fast(task: Task, most_m_s: float | None) -> None:
    """A target that moves faster than the vehicle may cannot be followed."""
    moves = task.motion if isinstance(task, Goto) else None
    speeds = (task.speed_m_s or 0.0, 0.0 if moves is None else math.hypot(moves.north_m_s, moves.east_m_s))
    if most_m_s is not None and max(speeds) > most_m_s:
        raise TaskRefusedError(f"{max(speeds):g} m/s is more than {most_m_s:g} m/s", refusal="limit.speed")


def _refuse_unsayable(points: tuple[Ground, ...], up_m: float | None) -> None:
    """However the limits are configured, a setpoint counts its metres from the EKF origin up to a bound."""
    farthest_m = max(abs(metres) for point in points for metres in (*point, up_m or 0.0))
    if not farthest_m <= MOST_METRES:
        raise TaskRefusedError(
            f"{farthest_m / 1000.0:.0f} km from the EKF origin is more than a setpoint can say",
            refusal="limit.distance",
        )


def _refuse_for_wing(task: Task, course: Course) -> None:
    if isinstance(task, Goto) and task.gripper is not None:
        raise TaskRefusedError(
            "a wing cannot stop for the gripper", refusal="tasks.cannot_stop", hint="let a plan drop it in passing"
        )
    if isinstance(course, CircleCourse) and abs(course.radius_m) < WING_SMALLEST_M:
        raise TaskRefusedError(
            f"a wing flies no circle of less than {WING_SMALLEST_M:g} m", refusal="tasks.radius_too_small"
        )


def _refuse_beyond_fence(points: tuple[Ground, ...], where: Whereabouts) -> None:
    if where.fence is None:
        return
    north, east, _ = where.home_ned or (0.0, 0.0, 0.0)
    around_home = [(point[1] - east, point[0] - north) for point in points]
    shape = Point(around_home[0]) if len(around_home) == 1 else LineString(around_home)
    if not where.fence.allows(shape):
        raise TaskRefusedError("it leads out of the fence on board", refusal="limit.fence")


def _outline(course: Course, kind: FlightKind) -> tuple[Ground, ...]:
    """The course as corners. A wing at a place circles it."""
    if isinstance(course, LegsCourse):
        return course.points
    if isinstance(course, PointCourse) and kind is not FlightKind.WING:
        return (course.point,)
    center = course.point if isinstance(course, PointCourse) else course.center
    radius_m = WING_LOITER_M if isinstance(course, PointCourse) else abs(course.radius_m)
    outside_m = radius_m / math.cos(math.pi / _CORNERS)
    turns = (2.0 * math.pi * corner / _CORNERS for corner in range(_CORNERS + 1))
    return tuple((center[0] + outside_m * math.cos(turn), center[1] + outside_m * math.sin(turn)) for turn in turns)


def _without_repeats(points: tuple[Ground, ...]) -> tuple[Ground, ...]:
    kept = points[:1]
    for point in points[1:]:
        if math.dist(kept[-1], point) >= SHORTEST_M:
            kept = (*kept, point)
    return kept
