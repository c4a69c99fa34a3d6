"""Makes up for a hovering vehicle's lag in a turn: an aim inside the circle, as far as its flight shows it to need.

PX4 follows a velocity that turns late: the integrator of its velocity loop carries the drag, and turns with the course.
How late depends on gains, drag, speed and radius, so it is learnt: while it stays outside, the aim moves inwards.
"""

from __future__ import annotations

import math
from typing import Final

from app.domain.tasks.course import CircleCourse, Course, Ground

BACK_PER_S: Final = 1.5
"""The share of its way back to the course that a hovering vehicle is asked to fly in a second."""
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
    """The lag after `seconds` in this place with this velocity: what comes back as asked has nothing to learn.

    Other courses than circles have no lag.
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
