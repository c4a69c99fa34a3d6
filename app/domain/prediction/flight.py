"""The flight of a plan: the vehicle, its home, the wind, and the plan's rally points in local metres."""

from __future__ import annotations

from app.domain.fence_area import FenceArea, fence_area
from app.domain.geo import LocalProjection
from app.domain.plan.document import Plan
from app.domain.plan.walk import reference_home
from app.domain.prediction.effort import Flight
from app.domain.prediction.wind import CALM, Wind
from app.domain.vehicle import GlobalPosition, VehicleFacts


def flight_of(plan: Plan, facts: VehicleFacts, wind: Wind = CALM) -> Flight:
    """What the prediction of every item looks at."""
    bare = Flight(facts, reference_home(plan, facts), wind)
    rally = tuple(bare.to_local(point.latitude_deg, point.longitude_deg) for point in plan.rally_points)
    return Flight(facts, bare.home, wind, rally, _fence_of(plan, bare.home))


def _fence_of(plan: Plan, home: GlobalPosition) -> FenceArea | None:
    """As newer firmware takes it: only that plans a return by it."""
    if not plan.geofence.polygons and not plan.geofence.circles:
        return None
    return fence_area(plan.geofence, LocalProjection(home.latitude_deg, home.longitude_deg), all_of_home=True)
