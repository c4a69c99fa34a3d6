"""The landing pattern of a fixed wing: descend on a circle, leave it on the tangent, glide to the ground.

The autopilot rejects a glide slope that is too steep, and a landing point inside the circle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from app.domain.autopilot import Quantity, quantity
from app.domain.geo import LatLon, bearing_deg, destination_deg, distance_m
from app.domain.items.fields import Position, relative_altitude_m
from app.domain.vehicle.state import GlobalPosition, VehicleProfile

DEFAULT_APPROACH_HEIGHT_M = 20.0
DEFAULT_APPROACH_RADIUS_M = 60.0
SLOPE_SHARE = 0.75
"""A computed approach uses this share of the steepest glide slope, to leave room for rounding."""


class Approach(Position):
    """A fixed wing descends on this circle, then lands along the tangent. The sign of the radius is the direction."""

    radius_m: Annotated[float, Field(ge=-1000, le=1000)] = 60.0


@dataclass(frozen=True, slots=True)
class LandingPattern:
    """The circle (centre and signed radius) and the straight glide from its tangent to the touchdown."""

    circle: LatLon
    radius_m: float
    touchdown: LatLon
    glide_m: float

    @property
    def height_m(self) -> float:
        """Altitude loss from the circle to the touchdown. Negative in an invalid plan."""
        return self.circle.relative_altitude_m - self.touchdown.relative_altitude_m

    @property
    def glide_angle_deg(self) -> float:
        """Slope of the glide; 90 degrees without a horizontal distance."""
        return math.degrees(math.atan2(self.height_m, self.glide_m))


def landing_pattern(
    item: Position, approach: Approach | None, start: LatLon, home: GlobalPosition, facts: VehicleProfile
) -> LandingPattern:
    """Return the landing pattern of a land item: its own approach, or one in line with the preceding item."""
    touchdown = LatLon(item.latitude_deg, item.longitude_deg, relative_altitude_m(item, home))
    if approach is not None:
        circle = LatLon(approach.latitude_deg, approach.longitude_deg, relative_altitude_m(approach, home))
        radius_m = approach.radius_m or DEFAULT_APPROACH_RADIUS_M
    else:
        circle, radius_m = _default_circle(touchdown, start, facts), DEFAULT_APPROACH_RADIUS_M
    away_m = distance_m(circle.latitude_deg, circle.longitude_deg, item.latitude_deg, item.longitude_deg)
    return LandingPattern(circle, radius_m, touchdown, math.sqrt(max(0.0, away_m**2 - radius_m**2)))


def _default_circle(touchdown: LatLon, start: LatLon, facts: VehicleProfile) -> LatLon:
    """On the line from the touchdown to the preceding position (north if the vehicle comes from above)."""
    angle = math.radians(max(1.0, quantity(facts, Quantity.GLIDE_DEG) * SLOPE_SHARE))
    away_m = math.hypot(DEFAULT_APPROACH_HEIGHT_M / math.tan(angle), DEFAULT_APPROACH_RADIUS_M)
    touch = (touchdown.latitude_deg, touchdown.longitude_deg)
    towards = bearing_deg(*touch, start.latitude_deg, start.longitude_deg)
    centre = destination_deg(*touch, towards, away_m)
    return LatLon(*centre, touchdown.relative_altitude_m + DEFAULT_APPROACH_HEIGHT_M)
