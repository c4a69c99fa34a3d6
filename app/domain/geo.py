"""Places and distances on a spherical earth, safe at the poles and at the antimeridian.

The projection is PX4's own (azimuthal equidistant, lib/geo MapProjection), so that metres here are metres there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

EARTH_RADIUS_M = 6_371_000.0
"""PX4's CONSTANTS_RADIUS_OF_EARTH."""


class LatLon(NamedTuple):
    """A position; altitude above home."""

    latitude_deg: float
    longitude_deg: float
    relative_altitude_m: float


def distance_m(latitude_a_deg: float, longitude_a_deg: float, latitude_b_deg: float, longitude_b_deg: float) -> float:
    """Great-circle distance between two places (haversine)."""
    latitude_a, latitude_b = math.radians(latitude_a_deg), math.radians(latitude_b_deg)
    half_north = math.sin((latitude_b - latitude_a) / 2)
    half_east = math.sin(math.radians(longitude_b_deg - longitude_a_deg) / 2)
    chord = half_north**2 + math.cos(latitude_a) * math.cos(latitude_b) * half_east**2
    return 2 * EARTH_RADIUS_M * math.asin(math.sqrt(min(1.0, chord)))


def bearing_deg(latitude_a_deg: float, longitude_a_deg: float, latitude_b_deg: float, longitude_b_deg: float) -> float:
    """Initial great-circle bearing from a to b, 0 to 360, north is 0."""
    latitude_a, latitude_b = math.radians(latitude_a_deg), math.radians(latitude_b_deg)
    longitude = math.radians(longitude_b_deg - longitude_a_deg)
    east = math.sin(longitude) * math.cos(latitude_b)
    north = math.cos(latitude_a) * math.sin(latitude_b) - math.sin(latitude_a) * math.cos(latitude_b) * math.cos(
        longitude
    )
    return math.degrees(math.atan2(east, north)) % 360.0


def destination_deg(
    latitude_deg: float, longitude_deg: float, bearing_deg: float, distance_m: float
) -> tuple[float, float]:
    """Latitude and longitude of the place `distance_m` away along `bearing_deg`."""
    latitude, bearing, arc = math.radians(latitude_deg), math.radians(bearing_deg), distance_m / EARTH_RADIUS_M
    sine = math.sin(latitude) * math.cos(arc) + math.cos(latitude) * math.sin(arc) * math.cos(bearing)
    end = math.asin(max(-1.0, min(1.0, sine)))
    turn = math.atan2(
        math.sin(bearing) * math.sin(arc) * math.cos(latitude), math.cos(arc) - math.sin(latitude) * math.sin(end)
    )
    return math.degrees(end), wrap_longitude_deg(longitude_deg + math.degrees(turn))


def wrap_longitude_deg(longitude_deg: float) -> float:
    """The same meridian in -180 to 180."""
    return (longitude_deg + 180.0) % 360.0 - 180.0


@dataclass(frozen=True, slots=True)
class LocalProjection:
    """East and north in metres around an origin. Distances from the origin are exact, others nearly so nearby."""

    latitude_deg: float
    longitude_deg: float

    def to_local(self, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        """(east_m, north_m) of a place: `distance_m` along `bearing_deg`, in one go: every leg of a plan asks it."""
        latitude_a, latitude_b = math.radians(self.latitude_deg), math.radians(latitude_deg)
        longitude = math.radians(longitude_deg - self.longitude_deg)
        cos_a, cos_b = math.cos(latitude_a), math.cos(latitude_b)
        chord = math.sin((latitude_b - latitude_a) / 2) ** 2 + cos_a * cos_b * math.sin(longitude / 2) ** 2
        away_m = 2 * EARTH_RADIUS_M * math.asin(math.sqrt(min(1.0, chord)))
        east = math.sin(longitude) * cos_b
        north = cos_a * math.sin(latitude_b) - math.sin(latitude_a) * cos_b * math.cos(longitude)
        reach = math.hypot(east, north)
        return (away_m * east / reach, away_m * north / reach) if reach > 0.0 else (0.0, away_m)

    def to_global(self, east_m: float, north_m: float) -> tuple[float, float]:
        """(latitude_deg, longitude_deg) of a local point."""
        bearing = math.degrees(math.atan2(east_m, north_m))
        return destination_deg(self.latitude_deg, self.longitude_deg, bearing, math.hypot(east_m, north_m))
