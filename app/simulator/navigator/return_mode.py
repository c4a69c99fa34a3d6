"""AUTO.RTL: climb, fly home (or where RTL_TYPE says), land (a plane circles there)."""

from __future__ import annotations

import math
from enum import Enum, auto

from app.simulator.navigator.context import NavContext
from app.simulator.navigator.return_destination import ReturnDestination
from app.simulator.setpoint import SetpointKind
from app.simulator.wire import Cmd, Severity, VtolState

CONE_HALF_ANGLE_RAD = math.radians(45.0)  # RTL_CONE_ANG
ALTITUDE_TOLERANCE_M = 0.8
ROUNDING_M = 0.01
"""Heights are said in whole metres, rounded up; this much is no metre more."""


class _Stage(Enum):
    CLIMB = auto()
    RETURN = auto()
    LAND = auto()
    LOITER = auto()


class ReturnMode:
    """The destination is chosen when the mode is entered."""

    def __init__(self, context: NavContext, destination: ReturnDestination) -> None:
        self._context = context
        self._chosen = destination
        self._stage = _Stage.CLIMB
        self._destination = (0.0, 0.0)
        self._ground_m = 0.0
        self._return_up_m = 0.0
        self.finished = False

    def activate(self) -> None:
        context = self._context
        body = context.state.body
        self.finished = False
        context.gimbal.start(context.now_s)
        self._destination = self._chosen.choose()
        self._ground_m = context.home.up_m
        if context.state.status.landed:
            context.set_point(SetpointKind.IDLE, (body.north_m, body.east_m), body.up_m)
            self._stage = _Stage.LAND
            return
        self._return_up_m = max(self._cone_altitude(), body.up_m)
        if context.airframe.is_rover:
            self._land()
        above_m = self._return_up_m - self._ground_m
        amsl_m = context.frame.altitude_m + self._return_up_m
        amsl, above = (math.ceil(height_m - ROUNDING_M) for height_m in (amsl_m, above_m))
        context.text(Severity.INFO, f"RTL: start return at {amsl} m ({above} m above destination)")
        context.event("vrtl_return_at")
        if context.airframe.is_rover:
            return
        self._stage = _Stage.CLIMB
        context.set_point(SetpointKind.LOITER, context.stop_point(), self._return_up_m)

    def step(self) -> None:
        if self._stage is _Stage.CLIMB and self._at_altitude():
            self._stage = _Stage.RETURN
            self._context.set_point(SetpointKind.POSITION, self._destination, self._return_up_m)
        elif self._stage is _Stage.RETURN and self._arrived():
            self._arrive()
        elif self._stage is _Stage.LAND:
            self._finish_when_landed()

    def _finish_when_landed(self) -> None:
        """PX4's return ends in an idle item, which is said like a command [06_quad_delivery_default]."""
        context, landed = self._context, self._context.state.status.landed
        if landed and not self.finished:
            acceptance_m, loiter_m = (float(context.params[name]) for name in ("NAV_ACC_RAD", "NAV_LOITER_RAD"))
            amsl_m = context.frame.altitude_m + self._ground_m
            context.command((Cmd.IDLE, (0.0, acceptance_m, loiter_m, math.nan, 0.0, 0.0, amsl_m)))
        self.finished = landed

    def _arrive(self) -> None:
        context = self._context
        if context.airframe.is_vtol and context.flies_like_plane:
            context.command((Cmd.DO_VTOL_TRANSITION, (float(VtolState.MC), 0.0, 0.0, 0.0)))
        elif context.flies_like_plane:
            self._stage = _Stage.LOITER
            descend_m = self._ground_m + float(context.params["RTL_DESCEND_ALT"])
            context.set_point(SetpointKind.LOITER, self._destination, min(self._return_up_m, descend_m))
            return
        self._land()

    def _land(self) -> None:
        """What drives begins with this [21_offboard_rover]."""
        context = self._context
        self._stage = _Stage.LAND
        context.text(Severity.INFO, "RTL: land at destination")
        context.event("rtl_land_at_destination")
        context.set_point(SetpointKind.LAND, self._destination, self._ground_m)

    def _cone_altitude(self) -> float:
        """RTL_RETURN_ALT, less when the vehicle is near home already (calculate_return_alt_from_cone_half_angle)."""
        params = self._context.params
        body = self._context.state.body
        distance_m = math.dist((body.north_m, body.east_m), self._destination)
        radius_m = float(params["NAV_ACC_RAD"])
        if distance_m <= radius_m:
            return self._ground_m + 2.0 * distance_m
        height_m = float(params["RTL_RETURN_ALT"])
        if distance_m <= float(params["RTL_MIN_DIST"]):
            height_m = distance_m / math.tan(CONE_HALF_ANGLE_RAD)
        return self._ground_m + max(height_m, 2.0 * radius_m)

    def _at_altitude(self) -> bool:
        context = self._context
        tolerance_m = float(context.params["NAV_FW_ALT_RAD"]) if context.flies_like_plane else ALTITUDE_TOLERANCE_M
        return context.state.body.up_m >= self._return_up_m - tolerance_m

    def _arrived(self) -> bool:
        body = self._context.state.body
        distance_m = math.dist((body.north_m, body.east_m), self._destination)
        return distance_m <= float(self._context.params["NAV_ACC_RAD"])
