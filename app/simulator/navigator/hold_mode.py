"""AUTO.LOITER: stop (or circle) here, or at the point of the last DO_REPOSITION."""

from __future__ import annotations

import math

from app.simulator.navigator.context import NavContext
from app.simulator.setpoint import SetpointKind

TAKEOFF_TOLERANCE_M = 0.8


class HoldMode:
    """Hold. `reposition` moves the held point, also before the mode is entered."""

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._wanted: tuple[float | None, float | None, float | None, float | None] | None = None

    def reposition(
        self, point: tuple[float, float] | None, up_m: float | None, orbit_radius_m: float | None = None
    ) -> None:
        """DO_REPOSITION: None keeps the present place or height. DO_ORBIT of a plane: with a radius, signed."""
        north, east = point if point is not None else (None, None)
        self._wanted = (north, east, up_m, orbit_radius_m)

    def activate(self) -> None:
        context = self._context
        body = context.state.body
        if context.state.status.landed:
            context.set_point(SetpointKind.IDLE, (body.north_m, body.east_m), body.up_m)
        else:
            context.set_point(SetpointKind.LOITER, context.stop_point(), self._height_m())

    def _height_m(self) -> float:
        """Where it is; after a finished takeoff, where that was to end."""
        body, before = self._context.state.body, self._context.setpoint
        finished = before.kind is SetpointKind.TAKEOFF and body.up_m >= before.up_m - TAKEOFF_TOLERANCE_M
        return before.up_m if finished else body.up_m

    def step(self) -> None:
        context = self._context
        if self._wanted is not None:
            north, east, up_m, radius_m = self._wanted
            self._wanted = None
            holding = context.setpoint.kind is SetpointKind.LOITER
            kept = context.setpoint.point if holding else context.stop_point()
            point = kept if north is None or east is None else (north, east)
            height = context.state.body.up_m if up_m is None or not math.isfinite(up_m) else up_m
            setpoint = context.set_point(SetpointKind.LOITER, point, height)
            if radius_m is not None:
                setpoint.loiter_radius_m, setpoint.loiter_clockwise = abs(radius_m), radius_m > 0.0
        elif context.setpoint.kind is SetpointKind.IDLE and not context.state.status.landed:
            self.activate()
