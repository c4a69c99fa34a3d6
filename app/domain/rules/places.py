"""The positions that a plan visits: one per position item, two for a fixed-wing landing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from app.domain.geo import LatLon, distance_m
from app.domain.items import Land
from app.domain.items.fields import Altitude
from app.domain.items.landing_pattern import landing_pattern
from app.domain.plan.walk import Step
from app.domain.rules.registry import RuleContext
from app.domain.vehicle.state import VehicleType


@dataclass(frozen=True, slots=True)
class PlannedPlace:
    """A position on the wire. `height_m` is above home, None if unknown."""

    step: Step
    place: LatLon
    height_m: float | None


def planned_places(context: RuleContext) -> Iterator[PlannedPlace]:
    """Return the positions in flying order. A fixed wing's approach comes before its landing."""
    for step in context.steps:
        for place, altitude in _places(context, step):
            yield PlannedPlace(step, place, place.relative_altitude_m if context.knows_height(altitude) else None)


def from_home_m(context: RuleContext, place: LatLon) -> float:
    """Return the distance from home over ground."""
    home = context.home
    return distance_m(home.latitude_deg, home.longitude_deg, place.latitude_deg, place.longitude_deg)


def _places(context: RuleContext, step: Step) -> Iterator[tuple[LatLon, Altitude]]:
    item = step.item
    if isinstance(item, Land) and context.plan.vehicle_type is VehicleType.FIXED_WING:
        circle = landing_pattern(item, item.approach, step.start, context.origin, context.facts).circle
        yield circle, item.approach or item
    if (altitude := item.altitude()) is not None:
        yield step.end, altitude
