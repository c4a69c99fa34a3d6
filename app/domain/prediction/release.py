"""Where a drop is predicted to act, and where a parcel then falls."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

from app.domain.autopilot import Quantity, quantity
from app.domain.plan.compiler import STOP_RADIUS_M
from app.domain.plan.drops import DropUse
from app.domain.plan.walk import Step
from app.domain.prediction.durations import point_of
from app.domain.prediction.motion import CALM, FlightContext, MotionState, Point, Wind
from app.domain.prediction.timeline import PredictedDrop
from app.domain.prediction.wing import tightest_circle_m
from app.domain.vehicle.state import FlightRegime

GRAVITY_M_S2 = 9.80665
TERMINAL_M_S = 20.0
"""At which drag bears the weight: assumed, of a box of a kilogram with 0.04 m2 and a drag coefficient of 1."""
_STEPS = 200
_SHORTEST_STEP_S, _LONGEST_STEP_S = 0.005, 0.1
"""A longer one is not stable at the speeds that a plan can ask for."""
State = tuple[float, float, float]
"""East, north, down."""


@dataclass(frozen=True, slots=True)
class Fall:
    """The duration of the fall, and the distance east and north of the release at which the parcel lands."""

    duration_s: float
    moved: Point

    @property
    def throw_m(self) -> float:
        """Distance over ground from the release to the landing position."""
        return math.hypot(*self.moved)


@lru_cache(maxsize=1024)  # the rules predict a plan several times, with the same drops
def fall(height_m: float, velocity_m_s: Point, wind: Wind = CALM, terminal_m_s: float = TERMINAL_M_S) -> Fall:
    """From `height_m` to the height of home; quadratic drag against air that moves with the wind at all heights."""
    if height_m <= 0.0:
        return Fall(0.0, (0.0, 0.0))
    air: State = (wind.east_m_s, wind.north_m_s, 0.0)
    about_s = height_m / terminal_m_s + math.sqrt(2.0 * height_m / GRAVITY_M_S2)
    step_s = min(max(_SHORTEST_STEP_S, about_s / _STEPS), _LONGEST_STEP_S)
    place: State = (0.0, 0.0, 0.0)
    velocity: State = (*velocity_m_s, 0.0)
    seconds = 0.0
    while True:
        middle = _after(velocity, _pull(velocity, air, terminal_m_s), step_s / 2.0)
        following = _after(place, middle, step_s)
        if following[2] >= height_m:
            share = (height_m - place[2]) / (following[2] - place[2])
            end = _after(place, middle, share * step_s)
            return Fall(seconds + share * step_s, end[:2])
        velocity = _after(velocity, _pull(middle, air, terminal_m_s), step_s)
        place, seconds = following, seconds + step_s


def _after(start: State, rate: State, seconds: float) -> State:
    return (start[0] + rate[0] * seconds, start[1] + rate[1] * seconds, start[2] + rate[2] * seconds)


def _pull(velocity: State, air: State, terminal_m_s: float) -> State:
    """Gravity, and drag that grows with the square of the speed through the air."""
    east, north, down = velocity[0] - air[0], velocity[1] - air[1], velocity[2] - air[2]
    drag = GRAVITY_M_S2 * math.sqrt(east * east + north * north + down * down) / terminal_m_s**2
    return (-drag * east, -drag * north, GRAVITY_M_S2 - drag * down)


_CIRCLING = (FlightRegime.FIXED_WING, FlightRegime.BUOYANCY)


def predicted_drop(
    flight: FlightContext,
    drop: DropUse,
    anchor: Step,
    visit: int,
    at_s: float,
    there: MotionState,
    return_percent: float | None,
) -> PredictedDrop:
    """The release of one drop. `there` is the motion as its position item ends: a moving drop acts at that moment."""
    circling = anchor.item.circles() and drop.carried in _CIRCLING
    target = point_of(flight, anchor.end)
    away_m = 0.0 if drop.stopped else there.away_m(target)
    lead_m = 0.0 if circling or drop.carried is FlightRegime.GROUND else away_m
    offset_m = away_m
    if circling:
        offset_m = _circled_m(flight, drop, anchor, there)
    elif drop.stopped and drop.carried is FlightRegime.ROTARY_WING:
        offset_m = STOP_RADIUS_M
    moving_m_s = 0.0 if drop.stopped else there.speed_m_s
    height_m = (
        0.0 if drop.carried in (FlightRegime.GROUND, FlightRegime.WHEELS) else max(0.0, anchor.end.relative_altitude_m)
    )
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


def _circled_m(flight: FlightContext, drop: DropUse, anchor: Step, there: MotionState) -> float:
    """Distance from the centre: the radius, or that of the tightest turn if the vehicle cannot fly it."""
    asked_m = abs(anchor.item.circle_radius_m() or quantity(flight.facts, Quantity.LOITER_RADIUS_M))
    return max(asked_m, tightest_circle_m(there.speed_m_s)) if drop.carried is FlightRegime.FIXED_WING else asked_m
