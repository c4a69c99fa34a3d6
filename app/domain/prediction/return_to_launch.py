"""RTL: where PX4 returns to by RTL_TYPE, and how high.

Types 2 and 4 follow the mission's path; their distance and time here are the direct ones, and said to be unsure.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from app.domain.default_facts import parameter
from app.domain.prediction.effort import Flight
from app.domain.prediction.motion import Motion, Point
from app.domain.vehicle import VehicleFacts

HOME: Point = (0.0, 0.0)


def follows_mission(facts: VehicleFacts) -> bool:
    """Whether a return flies along the mission's items, on or back, instead of straight."""
    return int(parameter(facts, "RTL_TYPE")) in (2, 4)


def destination(flight: Flight, here: Motion, landings: Sequence[tuple[int, Point]], index: int) -> Point:
    """The place of the return. `landings` are the plan's land items with their index; `index` is the return's own.

    0 home or the nearest rally point, 1 the nearest of rally points and the mission's landing, 2 that landing, 3 the
    nearest of all, 4 the landing or home, whichever is fewer items away, 5 the nearest rally point; home where there is
    nothing of that. The first land item is the mission's landing, also one at a customer's.
    """
    rally, landing = flight.rally_points, [point for _, point in landings[:1]]
    match int(parameter(flight.facts, "RTL_TYPE")):
        case 1:
            return _nearest(here, (*landing, *rally))
        case 2:
            return _nearest(here, landing)
        case 3:
            return _nearest(here, (HOME, *landing, *rally))
        case 4:
            fewer = bool(landings) and abs(landings[0][0] - index) <= index
            return _nearest(here, landing if fewer else ())
        case 5:
            return _nearest(here, rally)
    return _nearest(here, (HOME, *rally))


def return_up_m(flight: Flight, here: Motion, to: Point) -> float:
    """The height above home: RTL_RETURN_ALT, less within RTL_MIN_DIST of the place, never below the present one."""
    away_m, radius_m = here.away_m(to), parameter(flight.facts, "NAV_ACC_RAD")
    if away_m <= radius_m:
        return max(here.up_m, 2.0 * away_m)
    height_m = parameter(flight.facts, "RTL_RETURN_ALT")
    if away_m <= parameter(flight.facts, "RTL_MIN_DIST"):
        cone_deg = min(89.0, max(1.0, parameter(flight.facts, "RTL_CONE_ANG")))
        height_m = min(height_m, away_m / math.tan(math.radians(cone_deg)))
    return max(here.up_m, height_m, 2.0 * radius_m)


def _nearest(here: Motion, places: Iterable[Point]) -> Point:
    return min(places, key=here.away_m, default=HOME)
