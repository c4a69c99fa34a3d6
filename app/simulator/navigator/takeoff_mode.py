"""AUTO.TAKEOFF: climb to MIS_TAKEOFF_ALT, or to the altitude of the NAV_TAKEOFF command."""

from __future__ import annotations

import math

from app.simulator.navigator.context import NavContext
from app.simulator.setpoint import SetpointKind
from app.simulator.wire import Severity

ALTITUDE_TOLERANCE_M = 0.8
PLANE_RUN_M = 300.0


class TakeoffMode:
    """Take off; `finished` lets the commander change to hold."""

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._wanted_up_m: float | None = None
        self.finished = False

    def command_altitude(self, up_m: float | None) -> None:
        """Height of the next takeoff; None: MIS_TAKEOFF_ALT above the ground."""
        self._wanted_up_m = up_m

    def activate(self) -> None:
        context = self._context
        body = context.state.body
        default_m = float(context.params["MIS_TAKEOFF_ALT"])
        if self._wanted_up_m is None:
            context.text(Severity.INFO, f"Using default takeoff altitude: {default_m:.1f} m")
            context.event("navigator_takeoff_default_alt", default_m)
        up_m = max(body.up_m + default_m, self._wanted_up_m or 0.0)
        self._wanted_up_m = None
        self.finished = False
        run_m = PLANE_RUN_M if context.flies_like_plane else 0.0
        ahead = (body.north_m + run_m * math.cos(body.yaw_rad), body.east_m + run_m * math.sin(body.yaw_rad))
        context.set_point(SetpointKind.TAKEOFF, ahead, up_m, previous=(body.north_m, body.east_m))

    def step(self) -> None:
        context = self._context
        if context.state.body.up_m >= context.setpoint.up_m - ALTITUDE_TOLERANCE_M:
            self.finished = True
