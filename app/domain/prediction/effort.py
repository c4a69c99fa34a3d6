"""What one item takes, and what the prediction of an item needs to know of its flight."""

from __future__ import annotations

from dataclasses import dataclass, field

from app.domain.fence_area import FenceArea
from app.domain.geo import LocalProjection
from app.domain.prediction.motion import Motion, Point
from app.domain.prediction.wind import CALM, Wind
from app.domain.vehicle import GlobalPosition, VehicleFacts


@dataclass(frozen=True, slots=True)
class Effort:
    """Distance and time of one item, and how the vehicle moves at its end. `unsure_s`: see TimelineEntry.

    `climbed_m` is the height that it gains on the way, if not simply that from its beginning to its end.
    """

    distance_m: float
    duration_s: float
    end: Motion
    unsure_s: float = 0.0
    climbed_m: float | None = None


@dataclass(frozen=True, slots=True)
class Flight:
    """The vehicle, its home, the wind, the rally points and the fence (east and north of home)."""

    facts: VehicleFacts
    home: GlobalPosition
    wind: Wind = CALM
    rally_points: tuple[Point, ...] = field(default=())
    fence: FenceArea | None = None

    @property
    def _projection(self) -> LocalProjection:
        return LocalProjection(self.home.latitude_deg, self.home.longitude_deg)

    def to_local(self, latitude_deg: float, longitude_deg: float) -> Point:
        """East and north of home."""
        return self._projection.to_local(latitude_deg, longitude_deg)

    def to_global(self, point: Point) -> tuple[float, float]:
        """Latitude and longitude in degrees."""
        return self._projection.to_global(*point)
