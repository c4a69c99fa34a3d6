"""Where a predicted vehicle is and how it moves: each item begins where and as the one before it ended."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

Point = tuple[float, float]
"""East and north of home, in metres."""


@dataclass(frozen=True, slots=True)
class Motion:
    """`course_rad` is the way it flies (east of north), `heading_rad` where its nose points; None: not known."""

    point: Point = (0.0, 0.0)
    up_m: float = 0.0
    speed_m_s: float = 0.0
    course_rad: float | None = None
    heading_rad: float | None = None

    def away_m(self, point: Point) -> float:
        """Horizontal distance to a point."""
        return math.dist(self.point, point)

    def course_to(self, point: Point) -> float:
        """The course to a point; its own at the point."""
        if self.away_m(point) < 0.01:
            return self.course_rad or 0.0
        return course(self.point, point)

    def turn_to(self, point: Point) -> float:
        """How far it has to turn towards a point, 0 to pi; 0 if it does not move."""
        if self.course_rad is None or self.away_m(point) < 0.01:
            return 0.0
        return turn(self.course_rad, self.course_to(point))

    def arrived(self, point: Point, before_m: float, up_m: float, speed_m_s: float) -> Motion:
        """The motion `before_m` before a point on the straight way to it; not before its start."""
        along = self.course_to(point)
        back_m = min(before_m, self.away_m(point))
        there = ahead(point, along + math.pi, back_m)
        return Motion(there, up_m, speed_m_s, along if speed_m_s > 0.0 else None, along)

    def standing(self, point: Point | None = None, up_m: float | None = None) -> Motion:
        """At rest, there or here."""
        at, up = self.point if point is None else point, self.up_m if up_m is None else up_m
        return replace(self, point=at, up_m=up, speed_m_s=0.0, course_rad=None)


def course(start: Point, end: Point) -> float:
    """Course of a line in radians, 0 is north and east is positive."""
    return math.atan2(end[0] - start[0], end[1] - start[1])


def ahead(point: Point, course_rad: float, distance_m: float) -> Point:
    """The point so far along a course."""
    return point[0] + distance_m * math.sin(course_rad), point[1] + distance_m * math.cos(course_rad)


def turn(before_rad: float, after_rad: float) -> float:
    """The angle between two courses, 0 to pi."""
    return abs((after_rad - before_rad + math.pi) % math.tau - math.pi)
