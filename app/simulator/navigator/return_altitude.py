"""How high a return flies (PX4's RTL::computeReturnAltitude)."""

from __future__ import annotations

import math

from app.simulator.navigator.context import NavContext

CONE_HALF_ANGLE_RAD = math.radians(45.0)  # RTL_CONE_ANG


def return_up_m(context: NavContext, destination: tuple[float, float], ground_m: float) -> float:
    """Height of the way to `destination`: never lower than now, less than RTL_RETURN_ALT when it is near."""
    return max(ground_m + _above_ground_m(context, destination), context.state.body.up_m)


def _above_ground_m(context: NavContext, destination: tuple[float, float]) -> float:
    params, body = context.params, context.state.body
    highest_m = float(params["RTL_RETURN_ALT"])
    if context.flies_like_plane:
        return highest_m
    distance_m = math.dist((body.north_m, body.east_m), destination)
    radius_m = float(params["NAV_ACC_RAD"])
    if distance_m <= radius_m:
        return 2.0 * distance_m
    if distance_m <= float(params["RTL_MIN_DIST"]):
        highest_m = min(highest_m, distance_m / math.tan(CONE_HALF_ANGLE_RAD))
    return max(highest_m, 2.0 * radius_m)
