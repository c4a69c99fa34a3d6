"""RTL straight to a place: where PX4 returns to by RTL_TYPE, and how high. Types 2 and 4: see path_return.py."""

from __future__ import annotations

import math
from collections.abc import Sequence

from shapely import LineString

from app.domain.autopilot import Quantity, quantity
from app.domain.autopilot.px4.parameters import parameter
from app.domain.fence_route import flies_round, margin_m, way_round
from app.domain.prediction.effort import Flight
from app.domain.prediction.motion import Motion, Point
from app.domain.vehicle import VehicleFacts

HOME: Point = (0.0, 0.0)
NEARLY_M = 20.0
"""Where the vehicle is as it chooses the nearest is not known better."""


def follows_mission(facts: VehicleFacts) -> bool:
    """Whether a return flies along the mission's items, on or back, instead of straight."""
    return int(parameter(facts, "RTL_TYPE")) in (2, 4)


def destination(flight: Flight, here: Motion, landing: Point | None) -> Point:
    """The place of the return: the nearest. `landing` is the plan's first land item, also one at a customer's."""
    return min(destinations(flight, here, landing), key=here.away_m)


def destinations(flight: Flight, here: Motion, landing: Point | None) -> Sequence[Point]:
    """The nearest place of those that RTL_TYPE knows, and all that are so little farther that it may be one of them.

    0 home and the rally points, 1 rally points and the mission's landing, 3 all, 5 rally points; home where there is
    nothing of that. Not for 2 and 4.
    """
    rally, landings = flight.rally_points, () if landing is None else (landing,)
    places: tuple[Point, ...] = (HOME, *rally)
    match int(parameter(flight.facts, "RTL_TYPE")):
        case 1:
            places = (*landings, *rally)
        case 3:
            places = (HOME, *landings, *rally)
        case 5:
            places = rally
    nearest_m = min((here.away_m(place) for place in places), default=0.0)
    return [place for place in places if here.away_m(place) <= nearest_m + NEARLY_M] or [HOME]


def way_of(flight: Flight, here: Point, to: Point) -> tuple[Point, ...]:
    """The corners of a direct return, the place itself last: round the fence with firmware that flies so."""
    if flight.fence is None or flight.fence.allows(LineString([here, to])) or not flies_round(flight.facts):
        return (to,)
    way = way_round(flight.fence, here, to, margin_m(flight.facts))
    return (to,) if way is None else way[1:]


def return_up_m(flight: Flight, here: Motion, to: Point) -> float:
    """The height above home: RTL_RETURN_ALT, less within RTL_MIN_DIST of the place, never below the present one."""
    away_m, radius_m = here.away_m(to), quantity(flight.facts, Quantity.ACCEPTANCE_RADIUS_M)
    if away_m <= radius_m:
        return max(here.up_m, 2.0 * away_m)
    height_m = quantity(flight.facts, Quantity.RETURN_HEIGHT_M)
    if away_m <= quantity(flight.facts, Quantity.RETURN_NEAR_M):
        cone_deg = min(89.0, max(1.0, quantity(flight.facts, Quantity.RETURN_CONE_DEG)))
        height_m = min(height_m, away_m / math.tan(math.radians(cone_deg)))
    return max(here.up_m, height_m, 2.0 * radius_m)
