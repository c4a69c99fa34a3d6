"""Where a drop is predicted to act, and where a parcel then falls."""

from __future__ import annotations

import math

from app.domain.acceptance import STOP_RADIUS_M, reach_m
from app.domain.default_facts import parameter
from app.domain.geo import bearing_deg, destination_deg, distance_m
from app.domain.plan.drops import DropUse
from app.domain.plan.items import Loiter, Waypoint
from app.domain.plan.walk import Carried, Step
from app.domain.prediction.timeline import PredictedDrop
from app.domain.vehicle import VehicleFacts

GRAVITY_M_S2 = 9.80665
_CIRCLING = (Carried.FIXED_WING, Carried.BUOYANCY)


def predicted_drop(
    facts: VehicleFacts, drop: DropUse, anchor: Step, visit: int, at_s: float, speed_m_s: float
) -> PredictedDrop:
    """The release of one drop at its anchor. `speed_m_s` is the ground speed of the leg."""
    circling = isinstance(anchor.item, Loiter) and drop.carried in _CIRCLING
    lead_m = 0.0 if circling or drop.carried is Carried.GROUND else lead_of(facts, drop, anchor, speed_m_s)
    moving_m_s = 0.0 if drop.stopped else speed_m_s
    height_m = 0.0 if drop.carried in (Carried.GROUND, Carried.WHEELS) else max(0.0, anchor.end.relative_altitude_m)
    fall_s = math.sqrt(2 * height_m / GRAVITY_M_S2)
    latitude, longitude = (None, None) if circling else _before(anchor, lead_m)
    return PredictedDrop(
        item_id=drop.item.id,
        visit=visit,
        supervised=drop.supervised,
        release_motion=drop.item.release_motion,
        at_s=at_s,
        ground_speed_m_s=moving_m_s,
        relative_altitude_m=anchor.end.relative_altitude_m,
        lead_m=lead_m,
        offset_m=_radius_m(facts, anchor) if circling else lead_m,
        release_latitude_deg=latitude,
        release_longitude_deg=longitude,
        fall_s=fall_s,
        throw_m=moving_m_s * fall_s,
    )


def lead_of(facts: VehicleFacts, drop: DropUse, anchor: Step, speed_m_s: float) -> float:
    """How far before the point the release happens. A stopped rover has rolled to its point (0.1 m, flown)."""
    if drop.stopped:
        return STOP_RADIUS_M if drop.carried is Carried.ROTARY_WING else 0.0
    item = anchor.item
    return reach_m(facts, drop.carried, speed_m_s, item.acceptance_radius_m if isinstance(item, Waypoint) else None)


def _before(anchor: Step, lead_m: float) -> tuple[float, float]:
    """The point `lead_m` before the end of the leg; not before its start."""
    start, end = anchor.start, anchor.end
    start_at, end_at = (start.latitude_deg, start.longitude_deg), (end.latitude_deg, end.longitude_deg)
    back_m = min(lead_m, distance_m(*start_at, *end_at))
    return destination_deg(*end_at, bearing_deg(*end_at, *start_at), back_m) if back_m > 0 else end_at


def _radius_m(facts: VehicleFacts, anchor: Step) -> float:
    own = anchor.item.radius_m if isinstance(anchor.item, Loiter) else None
    return abs(own or parameter(facts, "NAV_LOITER_RAD"))
