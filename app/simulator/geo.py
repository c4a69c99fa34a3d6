"""A flat local frame (north, east, up in metres) around a fixed origin; good to a few kilometres."""

from __future__ import annotations

import math
from dataclasses import dataclass

METRES_PER_DEGREE = math.radians(1.0) * 6_371_000.0
"""PX4 projects on a sphere of this radius."""


@dataclass(frozen=True, slots=True)
class LocalFrame:
    """Origin of a vehicle's local frame. `altitude_m` (AMSL) is the ground's altitude there: up = 0."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float

    def to_local(self, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        """North and east in metres."""
        north_m = (latitude_deg - self.latitude_deg) * METRES_PER_DEGREE
        return north_m, (longitude_deg - self.longitude_deg) * METRES_PER_DEGREE * self._cos

    def to_global(self, north_m: float, east_m: float) -> tuple[float, float]:
        """Latitude and longitude in degrees."""
        latitude_deg = self.latitude_deg + north_m / METRES_PER_DEGREE
        return latitude_deg, self.longitude_deg + east_m / (METRES_PER_DEGREE * self._cos)

    @property
    def _cos(self) -> float:
        return math.cos(math.radians(self.latitude_deg))


def wrap_pi(angle_rad: float) -> float:
    """The same angle in (-pi, pi]."""
    return -((math.pi - angle_rad) % (2.0 * math.pi) - math.pi)
