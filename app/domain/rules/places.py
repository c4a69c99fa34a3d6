"""The places to which a plan sends the vehicle: one a position item, two for a fixed-wing landing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from app.domain.geo import distance_m
from app.domain.landing_pattern import landing_pattern
from app.domain.plan.items import Land, Loiter, Takeoff, Waypoint
from app.domain.plan.walk import Place, Step
from app.domain.rules.registry import RuleContext
from app.domain.vehicle import VehicleType


@dataclass(frozen=True, slots=True)
class PlannedPlace:
    """A place with a position on the wire, and how far from home it lies."""

    step: Step
    place: Place
    from_home_m: float


def planned_places(context: RuleContext) -> Iterator[PlannedPlace]:
    """In flying order; the circle of a fixed wing's approach before its landing."""
    home = context.home
    for step in context.steps:
        for place in _places(context, step):
            away_m = distance_m(home.latitude_deg, home.longitude_deg, place.latitude_deg, place.longitude_deg)
            yield PlannedPlace(step, place, away_m)


def _places(context: RuleContext, step: Step) -> Iterator[Place]:
    item = step.item
    if isinstance(item, Land) and context.plan.vehicle_type is VehicleType.FIXED_WING:
        yield landing_pattern(item, step.start, context.home, context.facts).circle
    if isinstance(item, (Takeoff, Waypoint, Loiter, Land)):
        yield step.end
