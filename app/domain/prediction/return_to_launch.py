"""A return straight to a place: to which one, and how high. Along the mission's items: see path_return.py."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from app.domain.airspace import shapes
from app.domain.airspace.fence_route import NoWay
from app.domain.autopilot import Quantity, behaviour, quantity
from app.domain.prediction.motion import FlightContext, MotionState, Point
from app.domain.vehicle.state import FlightRegime, VehicleProfile

HOME: Point = (0.0, 0.0)
NEARLY_M = 20.0
"""Where the vehicle is as it chooses the nearest is not known better."""


def follows_mission(facts: VehicleProfile) -> bool:
    """Whether a return flies along the mission's items, on or back, instead of straight."""
    return behaviour(facts).returns.along_items


Landing = Callable[[], Point | None]
"""Of the plan; asked for by the vehicles alone that may return to it."""


def destination(flight: FlightContext, here: MotionState, landing: Landing) -> Point:
    """The place of the return: the nearest. `landing` is the plan's first land item, also one at a customer's."""
    return min(destinations(flight, here, landing), key=here.away_m)


def destinations(flight: FlightContext, here: MotionState, landing: Landing) -> Sequence[Point]:
    """The nearest of its places, and all that are so little farther that it may be one of them; home without any.

    Not for a return along the mission's items.
    """
    returns = behaviour(flight.facts).returns
    places: list[Point] = [HOME] if returns.to_home else []
    places += [lands_at] if returns.to_landing and (lands_at := landing()) is not None else []
    places += flight.rally_points
    nearest_m = min((here.away_m(place) for place in places), default=0.0)
    return [place for place in places if here.away_m(place) <= nearest_m + NEARLY_M] or [HOME]


def way_of(flight: FlightContext, here: Point, to: Point) -> tuple[Point, ...]:
    """The corners of a direct return, the place itself last: round the fence with firmware that flies so."""
    if flight.fence is None or flight.fence.allows(shapes.LineString([here, to])):
        return (to,)
    routes = flight.fence_routes if behaviour(flight.facts).returns_round_fence else None
    way = NoWay.BLOCKED if routes is None else routes.way(here, to)
    return (to,) if isinstance(way, NoWay) else way[1:]


def return_up_m(
    flight: FlightContext, here: MotionState, to: Point, carried: FlightRegime, to_up_m: float = 0.0
) -> float:
    """The height above home: as it is set above the place, which is `to_up_m` high, and never below the present one.

    A vehicle that hovers climbs less near to the place.
    """
    height_m = quantity(flight.facts, Quantity.RETURN_HEIGHT_M)
    if carried is not FlightRegime.FIXED_WING:
        height_m = _near_m(flight, here.away_m(to), height_m)
    return max(here.up_m, to_up_m + height_m)


def _near_m(flight: FlightContext, away_m: float, height_m: float) -> float:
    radius_m = quantity(flight.facts, Quantity.ACCEPTANCE_RADIUS_M)
    if away_m <= radius_m:
        return 2.0 * away_m
    if away_m <= quantity(flight.facts, Quantity.RETURN_NEAR_M):
        cone_deg = min(89.0, max(1.0, quantity(flight.facts, Quantity.RETURN_CONE_DEG)))
        height_m = min(height_m, away_m / math.tan(math.radians(cone_deg)))
    return max(height_m, 2.0 * radius_m)
