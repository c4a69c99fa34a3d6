"""The EKF origin: from where a vehicle's local coordinates count. Home is another place, and moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.domain.geo import LocalProjection
from app.domain.tasks.course import Ground
from app.domain.tasks.forms import GlobalPoint, LocalPoint, TaskModel
from app.domain.vehicle import VehicleState

_ROUNDS: Final = 3
"""The projection around the origin is looked for from the one around home: each round mends the rest."""


@dataclass(frozen=True, slots=True)
class EkfOrigin:
    """Degrees, metres AMSL; `home_up_m` is home above it now."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    home_up_m: float

    @classmethod
    def of(cls, state: VehicleState) -> EkfOrigin | None:
        """From HOME_POSITION, which gives home in both frames; None before it came."""
        home, local = state.home, state.home_ned_m
        if home is None or local is None:
            return None
        north, east, down = local
        latitude, longitude = LocalProjection(home.latitude_deg, home.longitude_deg).to_global(-east, -north)
        for _ in range(_ROUNDS):
            home_east, home_north = LocalProjection(latitude, longitude).to_local(home.latitude_deg, home.longitude_deg)
            latitude, longitude = LocalProjection(latitude, longitude).to_global(home_east - east, home_north - north)
        return cls(latitude, longitude, home.altitude_m + down, -down)

    def ground(self, point: LocalPoint | GlobalPoint) -> Ground:
        """North and east of a point."""
        if isinstance(point, LocalPoint):
            return point.north_m, point.east_m
        east, north = self._projection().to_local(point.latitude_deg, point.longitude_deg)
        return north, east

    def place(self, latitude_deg: float, longitude_deg: float) -> Ground:
        """North and east of a place on earth."""
        east, north = self._projection().to_local(latitude_deg, longitude_deg)
        return north, east

    def up_of(self, task: TaskModel) -> float | None:
        """The task's height above the origin; None if it says none."""
        if task.absolute_altitude_m is not None:
            return task.absolute_altitude_m - self.altitude_m
        return None if task.relative_altitude_m is None else self.home_up_m + task.relative_altitude_m

    def _projection(self) -> LocalProjection:
        return LocalProjection(self.latitude_deg, self.longitude_deg)
