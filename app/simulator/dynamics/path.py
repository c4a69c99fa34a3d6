"""Guidance: the course to steer to follow a line or a circle."""

from __future__ import annotations

import math
from dataclasses import dataclass

Point = tuple[float, float]


def course_on_line(here: Point, start: Point | None, end: Point, lookahead_m: float) -> float:
    """Course in radians along the line from `start` to `end`, towards the line when beside it."""
    direct = math.atan2(end[1] - here[1], end[0] - here[0])
    if start is None:
        return direct
    along = (end[0] - start[0], end[1] - start[1])
    length = math.hypot(*along)
    if length < 1.0:
        return direct
    cross_m = (-(here[0] - start[0]) * along[1] + (here[1] - start[1]) * along[0]) / length
    track = math.atan2(along[1], along[0])
    return track - math.atan2(cross_m, lookahead_m)


@dataclass(frozen=True, slots=True)
class Course:
    """Where to steer, and how strongly the path bends there: to the right above zero."""

    rad: float
    curvature_per_m: float = 0.0


def to_line(here: Point, start: Point | None, end: Point, bound_m: float, *, beyond: bool = False) -> Course:
    """A plane on the way from `start` to `end` (PX4's navigateWaypoints). `beyond`: it goes on past the end."""
    direct = Course(math.atan2(end[1] - here[1], end[0] - here[0]))
    if start is None:
        return direct
    along = (end[0] - start[0], end[1] - start[1])
    length_m = math.hypot(*along)
    if length_m < 1.0:
        return direct
    unit = (along[0] / length_m, along[1] / length_m)
    passed_m = (here[0] - start[0]) * unit[0] + (here[1] - start[1]) * unit[1]
    if passed_m > length_m and not beyond:
        return direct
    right_m = (here[1] - start[1]) * unit[0] - (here[0] - start[0]) * unit[1]
    return Course(_bearing(math.atan2(unit[1], unit[0]), right_m, bound_m)[0])


def around_circle(here: Point, centre: Point, radius_m: float, bound_m: float) -> Course:
    """A plane on its way to a circle and round it (PX4's navigateLoiter); clockwise if the radius is above zero."""
    outward = (here[0] - centre[0], here[1] - centre[1])
    distance_m, side = math.hypot(*outward), math.copysign(1.0, radius_m)
    tangent = math.atan2(outward[1], outward[0]) + side * math.pi / 2.0
    right_m = -side * (distance_m - abs(radius_m))
    bearing, nearness = _bearing(tangent, right_m, bound_m)
    return Course(bearing, side / max(distance_m, 1.0) * nearness)


def _bearing(tangent_rad: float, right_m: float, bound_m: float) -> tuple[float, float]:
    """NPFG: straight at a path that is `bound_m` away, along it on it; and how near it is, 0 to 1."""
    share = min(abs(right_m) / bound_m, 1.0)
    look_ahead = math.pi / 2.0 * (share - 1.0) ** 2
    away = math.pi / 2.0 - look_ahead
    return tangent_rad - math.copysign(away, right_m), math.sin(look_ahead) ** 2
