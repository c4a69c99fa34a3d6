"""Guidance: the course to steer to follow a line or a circle."""

from __future__ import annotations

import math

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


def course_on_circle(here: Point, centre: Point, radius_m: float, clockwise: bool) -> float:
    """Course in radians that joins the circle and stays on it (clockwise as seen from above)."""
    outward = (here[0] - centre[0], here[1] - centre[1])
    distance_m = math.hypot(*outward)
    bearing_out = math.atan2(outward[1], outward[0])
    side = 1.0 if clockwise else -1.0
    if distance_m > radius_m * 1.5:
        # far away: along the tangent
        return bearing_out + math.pi - side * math.asin(min(1.0, radius_m / distance_m))
    radial = math.atan2(2.0 * (distance_m - radius_m), radius_m * 0.6)
    return bearing_out + side * (math.pi / 2.0 + radial)
