"""Reports of a moving target, and its estimated position some time later."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Final

from pydantic import Field

from app.domain.geo import LocalProjection, distance_m
from app.domain.model import FrozenForm, StrictForm

STALE_S: Final = 5.0
"""A report older than this says nothing any more: at 2 m/s the target may be 10 m from where it was."""
FASTEST_M_S: Final = 100.0

_Velocity = Annotated[float, Field(ge=-FASTEST_M_S, le=FASTEST_M_S, allow_inf_nan=False)]


class TargetReport(StrictForm):
    """Where a target was at `time` (Unix seconds), WGS84, and how it moved over the ground."""

    latitude_deg: Annotated[float, Field(ge=-90, le=90, allow_inf_nan=False)]
    longitude_deg: Annotated[float, Field(ge=-180, le=180, allow_inf_nan=False)]
    north_m_s: _Velocity
    east_m_s: _Velocity
    time: Annotated[float, Field(ge=0, le=1e11, allow_inf_nan=False)]

    @property
    def speed_m_s(self) -> float:
        """Speed over ground."""
        return math.hypot(self.north_m_s, self.east_m_s)


class TargetEvidence(FrozenForm):
    """Where a target was by its newest report, at the moment of a release or when a drop ended without one.

    The place is predicted from the report, which was `age_s` old. `distance_m` is from the vehicle, over the ground.
    """

    feed: str
    latitude_deg: float
    longitude_deg: float
    north_m_s: float
    east_m_s: float
    age_s: float
    distance_m: float | None


@dataclass(frozen=True, slots=True)
class TargetFix:
    """The newest report of a feed, `age_s` after its measurement."""

    feed: str
    report: TargetReport
    age_s: float

    @property
    def is_stale(self) -> bool:
        """Whether the report is too old to be used."""
        return not self.age_s <= STALE_S

    def place(self, ahead_s: float = 0.0) -> tuple[float, float]:
        """Latitude and longitude in degrees, now or `ahead` seconds later, extrapolated from the report."""
        moved_s = self.age_s + ahead_s
        start = LocalProjection(self.report.latitude_deg, self.report.longitude_deg)
        return start.to_global(self.report.east_m_s * moved_s, self.report.north_m_s * moved_s)

    def distance_m(self, latitude_deg: float, longitude_deg: float) -> float:
        """Distance over ground from a position to the current position of the target."""
        return distance_m(*self.place(), latitude_deg, longitude_deg)

    def evidence(self, latitude_deg: float | None, longitude_deg: float | None) -> TargetEvidence:
        """For the record of a drop; the place is the vehicle's."""
        latitude, longitude = self.place()
        away_m = None
        if latitude_deg is not None and longitude_deg is not None:
            away_m = self.distance_m(latitude_deg, longitude_deg)
        return TargetEvidence(
            feed=self.feed,
            latitude_deg=latitude,
            longitude_deg=longitude,
            north_m_s=self.report.north_m_s,
            east_m_s=self.report.east_m_s,
            age_s=self.age_s,
            distance_m=away_m,
        )
