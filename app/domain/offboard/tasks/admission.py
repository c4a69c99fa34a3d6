"""Which tasks are queued: those that this vehicle can fly, within the limits and the fence on board."""

from __future__ import annotations

import math
from typing import Final

from app.domain.autopilot.capability import FlightKind
from app.domain.errors import SetpointRefusedError, TaskRefusedError
from app.domain.offboard.limits import OffboardLimits, VehiclePose
from app.domain.offboard.tasks.commanded import Wing, outline
from app.domain.offboard.tasks.course import (
    CircleCourse,
    Course,
    EkfOrigin,
    Ground,
    LegsCourse,
    PointCourse,
    circle_around,
    refuse_outside,
)
from app.domain.offboard.tasks.forms import Circle, Goto, Segment, Task
from app.domain.offboard.tasks.guidance import CRUISE_M_S, WING_LOITER_M

WING_SMALLEST_M: Final = 30.0
"""The circle of a small wing at 15 m/s and 35 degrees of bank."""
SHORTEST_M: Final = 0.5


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
            "the segment's start and end are the same place", refusal="task.no_length", hint="a goto leads to a place"
        )
    return PointCourse(legs[0])


def refuse_beyond(
    task: Task,
    course: Course,
    up_m: float | None,
    limits: OffboardLimits,
    where: VehiclePose,
    commanded: Wing | None = None,
) -> None:
    """`commanded`: the wing is flown by commands.

    Raises:
        TaskRefusedError: it leads beyond a limit or the fence, or this kind cannot do it.
    """
    if where.kind is FlightKind.WING:
        _refuse_for_wing(task, course)
    else:
        _refuse_too_fast(task, limits.max_speed_m_s)
    points = _outline(course, where.kind) if commanded is None else outline(course, commanded)
    try:
        refuse_outside(points, up_m, limits, where)
    except SetpointRefusedError as error:
        hint = "" if commanded is None else beyond_hint(course, commanded)
        raise TaskRefusedError(error.detail, refusal=error.refusal, hint=hint) from None


def beyond_hint(course: Course, wing: Wing) -> str:
    """A commanded wing needs room behind each leg, which nobody expects."""
    if not isinstance(course, LegsCourse):
        return ""
    needed_m = wing.reach_m(CRUISE_M_S[FlightKind.WING]) + wing.loiter_m
    return f"flown by commands it needs {needed_m:.0f} m behind each leg's end: there it circles if the link is lost"


def _refuse_too_fast(task: Task, most_m_s: float | None) -> None:
    """A target that moves faster than the vehicle may cannot be followed."""
    moves = task.motion if isinstance(task, Goto) else None
    speeds = (task.speed_m_s or 0.0, 0.0 if moves is None else math.hypot(moves.north_m_s, moves.east_m_s))
    if most_m_s is not None and max(speeds) > most_m_s:
        raise TaskRefusedError(f"{max(speeds):g} m/s is more than {most_m_s:g} m/s", refusal="limit.speed")


def _refuse_for_wing(task: Task, course: Course) -> None:
    if isinstance(task, Goto) and task.gripper is not None:
        raise TaskRefusedError(
            "a wing cannot stop for the gripper", refusal="task.cannot_stop", hint="let a plan drop it in passing"
        )
    if isinstance(course, CircleCourse) and abs(course.radius_m) < WING_SMALLEST_M:
        raise TaskRefusedError(
            f"a wing flies no circle of less than {WING_SMALLEST_M:g} m", refusal="task.radius_too_small"
        )


def _outline(course: Course, kind: FlightKind) -> tuple[Ground, ...]:
    """The course as corners. A wing at a place circles it."""
    if isinstance(course, LegsCourse):
        return course.points
    if isinstance(course, PointCourse) and kind is not FlightKind.WING:
        return (course.point,)
    center = course.point if isinstance(course, PointCourse) else course.center
    radius_m = WING_LOITER_M if isinstance(course, PointCourse) else abs(course.radius_m)
    return circle_around(center, radius_m)


def _without_repeats(points: tuple[Ground, ...]) -> tuple[Ground, ...]:
    kept = points[:1]
    for point in points[1:]:
        if math.dist(kept[-1], point) >= SHORTEST_M:
            kept = (*kept, point)
    return kept
