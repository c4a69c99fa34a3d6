"""Where a drop is predicted to act, and where a parcel then falls."""

from __future__ import annotations

import math

from app.domain.autopilot import Quantity, quantity
from app.domain.carried import Carried
from app.domain.compiler.drop_items import STOP_RADIUS_M
from app.domain.plan.drops import DropUse
from app.domain.plan.walk import Step
from app.domain.prediction.durations import point_of
from app.domain.prediction.effort import Flight
from app.domain.prediction.fall import fall
from app.domain.prediction.motion import Motion
from app.domain.prediction.timeline import PredictedDrop
from app.domain.vehicle import VehicleFacts

_CIRCLING = (Carried.FIXED_WING, Carried.BUOYANCY)


def predicted_drop(
    flight: Flight, drop: DropUse, anchor: Step, visit: int, at_s: float, there: Motion, return_percent: float | None
) -> PredictedDrop:
    """The release of one drop. `there` is the motion as its position item ends: a moving drop acts at that moment."""
    circling = anchor.item.circles() and drop.carried in _CIRCLING
    target = point_of(flight, anchor.end)
    away_m = 0.0 if drop.stopped else there.away_m(target)
    lead_m = 0.0 if circling or drop.carried is Carried.GROUND else away_m
    offset_m = away_m
    if circling:
        offset_m = _radius_m(flight.facts, anchor)
    elif drop.stopped and drop.carried is Carried.ROTARY_WING:
        offset_m = STOP_RADIUS_M
    moving_m_s = 0.0 if drop.stopped else there.speed_m_s
    height_m = 0.0 if drop.carried in (Carried.GROUND, Carried.WHEELS) else max(0.0, anchor.end.relative_altitude_m)
    along = there.course_rad or 0.0
    falls = fall(height_m, (moving_m_s * math.sin(along), moving_m_s * math.cos(along)), flight.wind)
    release = target if drop.stopped else there.point
    landing = (release[0] + falls.moved[0], release[1] + falls.moved[1])
    latitude, longitude = (None, None) if circling else flight.to_global(release)
    landing_latitude, landing_longitude = (None, None) if circling else flight.to_global(landing)
    return PredictedDrop(
        item_id=drop.item.id,
        visit=visit,
        supervised=drop.supervised,
        release_motion=drop.item.release_motion,
        at_s=at_s,
        ground_speed_m_s=moving_m_s,
        relative_altitude_m=anchor.end.relative_altitude_m,
        lead_m=lead_m,
        offset_m=offset_m,
        release_latitude_deg=latitude,
        release_longitude_deg=longitude,
        fall_s=falls.duration_s,
        throw_m=falls.throw_m,
        landing_latitude_deg=landing_latitude,
        landing_longitude_deg=landing_longitude,
        return_battery_percent=return_percent,
    )


def _radius_m(facts: VehicleFacts, anchor: Step) -> float:
    return abs(anchor.item.circle_radius_m() or quantity(facts, Quantity.LOITER_RADIUS_M))
