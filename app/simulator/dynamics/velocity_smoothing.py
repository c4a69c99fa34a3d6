"""One axis of a jerk-limited trajectory towards a velocity (PX4's VelocitySmoothing).

The way there has three parts: the acceleration grows, stays, and goes back to zero; each is given by its duration.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

TINY = 1e-7


@dataclass(slots=True)
class VelocitySmoothing:
    """`advance` moves along the plan, `plan` makes the next one, from the state reached."""

    max_jerk_m_s3: float = 4.0
    max_acceleration_m_s2: float = 0.0
    max_velocity_m_s: float = 0.0
    position_m: float = 0.0
    velocity_m_s: float = 0.0
    acceleration_m_s2: float = 0.0
    _goal_m_s: float = 0.0
    _direction: float = 0.0
    _growing_s: float = 0.0
    _steady_s: float = 0.0
    _falling_s: float = 0.0

    @property
    def duration_s(self) -> float:
        """Until the wanted velocity is reached."""
        return self._growing_s + self._steady_s + self._falling_s

    def reset(self, position_m: float, velocity_m_s: float = 0.0, acceleration_m_s2: float = 0.0) -> None:
        """Begin anew in this state."""
        self.position_m, self.velocity_m_s, self.acceleration_m_s2 = position_m, velocity_m_s, acceleration_m_s2
        self._growing_s = self._steady_s = self._falling_s = 0.0

    def advance(self, dt_s: float) -> None:
        """Move by `dt_s` along the plan made last; one `plan` allows one `advance`."""
        if self._direction == 0.0:
            self.position_m += self.velocity_m_s * dt_s
            return
        jerk = self._direction * self.max_jerk_m_s3
        for duration_s, part_jerk in ((self._growing_s, jerk), (self._steady_s, 0.0), (self._falling_s, -jerk)):
            if duration_s > 0.0:
                part_s = duration_s if duration_s < dt_s else dt_s
                self._move(part_s, part_jerk)
                dt_s -= part_s
                if dt_s <= 0.0:
                    return
        self.acceleration_m_s2 = 0.0
        self.position_m += self.velocity_m_s * dt_s

    def _move(self, t_s: float, jerk: float) -> None:
        acceleration, velocity = self.acceleration_m_s2, self.velocity_m_s
        self.acceleration_m_s2 = acceleration + jerk * t_s
        self.velocity_m_s = velocity + acceleration * t_s + jerk * t_s * t_s / 2.0
        self.position_m += velocity * t_s + acceleration * t_s * t_s / 2.0 + jerk * t_s**3 / 6.0

    def plan(self, velocity_m_s: float) -> None:
        """The quickest way to `velocity_m_s`."""
        limit = self.max_velocity_m_s
        self._goal_m_s = limit if velocity_m_s > limit else -limit if velocity_m_s < -limit else velocity_m_s
        self._direction = self._first_direction()
        if self._direction == 0.0:
            self._growing_s = self._steady_s = self._falling_s = 0.0
            return
        jerk, start = self._direction * self.max_jerk_m_s3, self.acceleration_m_s2
        missing = self._goal_m_s - self.velocity_m_s
        growing_s = 0.0
        under_root = 2.0 * start * start + 4.0 * jerk * missing
        if under_root >= 0.0:
            half = math.sqrt(under_root) / 2.0
            for candidate in ((half - start) / jerk, (-half - start) / jerk):
                if candidate >= 0.0 and start / jerk + candidate >= 0.0:
                    growing_s = candidate
                    break
        self._growing_s = max(self._within_acceleration(growing_s, jerk), 0.0)
        self._falling_s = max(start / jerk + self._growing_s, 0.0)
        top = start + jerk * self._growing_s
        self._steady_s = 0.0
        if abs(top) > TINY:
            gained = (start + top) / 2.0 * self._growing_s + top * self._falling_s - jerk * self._falling_s**2 / 2.0
            self._steady_s = max((missing - gained) / top, 0.0)

    def last(self, total_s: float) -> None:
        """Take `total_s` for it instead, with less acceleration."""
        if self._direction == 0.0:
            return
        jerk, start = self._direction * self.max_jerk_m_s3, self.acceleration_m_s2
        missing = self._goal_m_s - self.velocity_m_s
        rest = jerk * total_s - start
        under_root = (total_s * jerk) ** 2 + 2.0 * total_s * start * jerk - start * start - 4.0 * jerk * missing
        growing_s = 0.0
        if under_root >= 0.0:
            root = math.sqrt(under_root)
            for candidate in (max((rest - root) / (2.0 * jerk), 0.0), max((rest + root) / (2.0 * jerk), 0.0)):
                falling_s = start / jerk + candidate
                if falling_s >= 0.0 and candidate + falling_s <= total_s:
                    growing_s = candidate
                    break
            growing_s = self._within_acceleration(growing_s, jerk)
        self._growing_s = growing_s
        self._falling_s = max(start / jerk + growing_s, 0.0)
        self._steady_s = max(total_s - self._growing_s - self._falling_s, 0.0)

    def _first_direction(self) -> float:
        """Up or down first: by the velocity that would be left if the acceleration were taken back at once."""
        acceleration = self.acceleration_m_s2
        left = self._goal_m_s - self.velocity_m_s - acceleration * abs(acceleration) / (2.0 * self.max_jerk_m_s3)
        if left > TINY or left < -TINY:
            return 1.0 if left > 0.0 else -1.0
        if -TINY < acceleration < TINY:
            return 0.0
        return 1.0 if acceleration > 0.0 else -1.0

    def _within_acceleration(self, growing_s: float, jerk: float) -> float:
        top, limit = self.acceleration_m_s2 + jerk * growing_s, self.max_acceleration_m_s2
        if abs(top) <= limit:
            return growing_s
        return (math.copysign(limit, top) - self.acceleration_m_s2) / jerk


def synchronize(axes: Sequence[VelocitySmoothing]) -> None:
    """All axes take as long as the slowest, so that the track is straight (timeSynchronization)."""
    durations_s = [axis.duration_s for axis in axes]
    longest_s = max(durations_s)
    if longest_s <= TINY:
        return
    for axis, duration_s in zip(axes, durations_s, strict=True):
        if duration_s < longest_s:
            axis.last(longest_s)
