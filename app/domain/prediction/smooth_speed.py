"""How long a way takes on PX4's smoothed trajectories: jerk-limited starts, and slow-downs by distance.

Source: PX4 VelocitySmoothing (starts) and computeMaxSpeedFromDistance, computeMaxSpeedInWaypoint (slow-downs).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

SHORTEST_M = 0.05
_HALVINGS = 30


@dataclass(frozen=True, slots=True)
class Limits:
    """Of one axis of a trajectory."""

    speed_m_s: float
    acceleration_m_s2: float
    jerk_m_s3: float

    @property
    def _b(self) -> float:
        return 4.0 * self.acceleration_m_s2**2 / self.jerk_m_s3

    def start_s(self, gained_m_s: float) -> float:
        """Time to gain so much speed: the acceleration grows, stays, and falls again."""
        acceleration, jerk = self.acceleration_m_s2, self.jerk_m_s3
        if gained_m_s <= 0.0:
            return 0.0
        if gained_m_s < acceleration**2 / jerk:
            return 2.0 * math.sqrt(gained_m_s / jerk)
        return gained_m_s / acceleration + acceleration / jerk

    def speed_at_m_s(self, distance_m: float, final_m_s: float = 0.0) -> float:
        """The fastest that PX4 goes so far before a point that it is to pass with `final_m_s`."""
        under_root = self._b**2 + 8.0 * self.acceleration_m_s2 * max(0.0, distance_m) + 4.0 * final_m_s**2
        return max(0.5 * (-self._b + math.sqrt(under_root)), final_m_s)

    def slow_down_m(self, speed_m_s: float, final_m_s: float = 0.0) -> float:
        """How far before the point it begins to slow down."""
        if speed_m_s <= final_m_s:
            return 0.0
        return (speed_m_s**2 + self._b * speed_m_s - final_m_s**2) / (2.0 * self.acceleration_m_s2)

    def slow_down_s(self, speed_m_s: float, to_m: float, final_m_s: float = 0.0) -> float:
        """From the beginning of the slow-down until `to_m` before the point."""
        begin_m = self.slow_down_m(speed_m_s, final_m_s)
        if begin_m <= to_m:
            return 0.0
        there_m_s = max(self.speed_at_m_s(max(to_m, SHORTEST_M), final_m_s), 1e-3)
        lost = 2.0 * (speed_m_s - there_m_s) + self._b * math.log(max(speed_m_s, there_m_s) / there_m_s)
        crawl_m = max(0.0, self._b * final_m_s / (2.0 * self.acceleration_m_s2) - to_m) if final_m_s > 0.0 else 0.0
        return lost / (2.0 * self.acceleration_m_s2) + (crawl_m / final_m_s if crawl_m > 0.0 else 0.0)


def travel_s(
    way_m: float, limits: Limits, *, start_m_s: float = 0.0, end_m: float = 0.0, final_m_s: float = 0.0
) -> float:
    """Time from the start until `end_m` before the end of a straight way that ends with `final_m_s`."""
    if way_m <= end_m:
        return 0.0
    top_m_s = _top_m_s(way_m, limits, start_m_s, end_m, final_m_s)
    start_s = limits.start_s(top_m_s - start_m_s)
    start_m = (start_m_s + top_m_s) / 2.0 * start_s
    slow_m = max(limits.slow_down_m(top_m_s, final_m_s), end_m)
    level_m = max(0.0, way_m - start_m - slow_m)
    return start_s + level_m / max(top_m_s, 0.05) + limits.slow_down_s(top_m_s, end_m, final_m_s)


def _top_m_s(way_m: float, limits: Limits, start_m_s: float, end_m: float, final_m_s: float) -> float:
    """The speed that is reached: lower than the limit on a short way."""

    def fits(top_m_s: float) -> bool:
        start_m = (start_m_s + top_m_s) / 2.0 * limits.start_s(top_m_s - start_m_s)
        return start_m + max(limits.slow_down_m(top_m_s, final_m_s), end_m) <= way_m

    if fits(limits.speed_m_s):
        return limits.speed_m_s
    low, high = min(max(start_m_s, final_m_s, 0.05), limits.speed_m_s), limits.speed_m_s
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low


def speed_in_turn_m_s(turn_rad: float, acceleration_m_s2: float, radius_m: float) -> float:
    """How fast a corner is passed; `turn_rad` is 0 straight on, pi straight back."""
    if turn_rad < 1e-3:
        return math.inf
    return math.sqrt(acceleration_m_s2 * radius_m * math.tan(max(0.0, (math.pi - turn_rad) / 2.0)))
