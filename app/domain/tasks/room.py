"""The room that a task needs: whether places and the ways between them are within the limits and the fence on board."""

from __future__ import annotations

import math
from typing import Final

from shapely import LineString, Point

from app.domain.errors import SetpointRefusedError
from app.domain.setpoint.forms import MOST_METRES, PositionNed
from app.domain.setpoint.limiter import Whereabouts, limit
from app.domain.setpoint.limits import OffboardLimits
from app.domain.tasks.course import Ground

_CORNERS: Final = 24


def refuse_outside(points: tuple[Ground, ...], up_m: float | None, limits: OffboardLimits, where: Whereabouts) -> None:
    """Whether all of the way may be flown at this height; None: at the one of then, which is limited when it is flown.

    Raises:
        SetpointRefusedError: it leads beyond a limit or the fence, or is farther than a message can say.
    """
    _refuse_unsayable(points, up_m)
    strict = limits.model_copy(update={"beyond": "refuse"})
    if up_m is None:
        strict = strict.model_copy(update={"min_altitude_m": None, "max_altitude_m": None})
    anywhere = Whereabouts(kind=where.kind, home=where.home, home_ned=where.home_ned)
    for north, east in points:
        down_m = 0.0 if up_m is None else -up_m
        limit(PositionNed(type="position_ned", north_m=north, east_m=east, down_m=down_m), strict, anywhere)
    _refuse_beyond_fence(points, where)


def circle_around(center: Ground, radius_m: float) -> tuple[Ground, ...]:
    """Corners of a polygon outside the circle."""
    outside_m = radius_m / math.cos(math.pi / _CORNERS)
    turns = (2.0 * math.pi * corner / _CORNERS for corner in range(_CORNERS + 1))
    return tuple((center[0] + outside_m * math.cos(turn), center[1] + outside_m * math.sin(turn)) for turn in turns)


def _refuse_unsayable(points: tuple[Ground, ...], up_m: float | None) -> None:
    """However the limits are configured, a setpoint counts its metres from the EKF origin up to a bound."""
    farthest_m = max(abs(metres) for point in points for metres in (*point, up_m or 0.0))
    if not farthest_m <= MOST_METRES:
        raise SetpointRefusedError(
            f"{farthest_m / 1000.0:.0f} km from the EKF origin is more than a setpoint can say",
            refusal="limit.distance",
        )


def _refuse_beyond_fence(points: tuple[Ground, ...], where: Whereabouts) -> None:
    if where.fence is None:
        return
    north, east, _ = where.home_ned or (0.0, 0.0, 0.0)
    around_home = [(point[1] - east, point[0] - north) for point in points]
    shape = Point(around_home[0]) if len(around_home) == 1 else LineString(around_home)
    if not where.fence.allows(shape):
        raise SetpointRefusedError("it leads out of the fence on board", refusal="limit.fence")
