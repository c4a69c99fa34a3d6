"""What a steady wind makes of a wing's airspeed: a speed over ground along each track."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

_SLOWEST_M_S = 1.0


@dataclass(frozen=True, slots=True)
class Wind:
    """Where the air goes, over ground. Not `given`: nobody told a wind, and calm air is assumed."""

    north_m_s: float = 0.0
    east_m_s: float = 0.0
    given: bool = field(default=True, compare=False)

    @property
    def speed_m_s(self) -> float:
        """How strong it is."""
        return math.hypot(self.north_m_s, self.east_m_s)

    def ground_speed_m_s(self, airspeed_m_s: float, course_rad: float | None) -> float:
        """Along a track that is held against the wind; the airspeed where there is no track (a circle)."""
        if course_rad is None:
            return airspeed_m_s
        along = self.north_m_s * math.cos(course_rad) + self.east_m_s * math.sin(course_rad)
        across = self.east_m_s * math.cos(course_rad) - self.north_m_s * math.sin(course_rad)
        forward = math.sqrt(max(0.0, airspeed_m_s**2 - across**2))
        return max(_SLOWEST_M_S, forward + along)


CALM = Wind(given=False)
"""Assumed where no wind is given."""
