"""The simple flight modes: takeoff, hold, land, descend."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from app.simulator.navigator.context import NavContext
from app.simulator.setpoint import SetpointKind
from app.simulator.wire import Cmd, Severity, VtolState


class FlightMode(Protocol):
    """One AUTO mode, as the navigator sees it."""

    def activate(self) -> None:
        """The mode was entered."""

    def step(self) -> None:
        """One cycle while the mode is active and the vehicle armed."""


class LandMode:
    """Land at the present place; the commander disarms after COM_DISARM_LAND."""

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self.finished = False

    def activate(self) -> None:
        context = self._context
        self.finished = False
        context.gimbal.start(context.now_s)
        point = (math.nan, math.nan) if context.airframe.is_rover else context.stop_point()
        context.set_point(SetpointKind.LAND, point, 0.0)  # PX4's has no point either; the others brake there

    def step(self) -> None:
        self.finished = self._context.state.status.landed


class DescendMode:
    """Down without a position, wherever it drifts."""

    def __init__(self, context: NavContext) -> None:
        self._context = context

    def activate(self) -> None:
        context, body = self._context, self._context.state.body
        context.set_point(SetpointKind.DESCEND, (body.north_m, body.east_m), 0.0)
        if context.airframe.is_vtol and context.flies_like_plane:  # NAV_FORCE_VT
            context.command((Cmd.DO_VTOL_TRANSITION, (float(VtolState.MC), 0.0, 0.0, 0.0)))

    def step(self) -> None:
        """Nothing changes on the way."""


ALTITUDE_TOLERANCE_M = 0.8
PLANE_RUN_M = 300.0


class TakeoffMode:
    """AUTO.TAKEOFF: to MIS_TAKEOFF_ALT, or as NAV_TAKEOFF says; `finished` lets the commander change to hold."""

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


TAKEOFF_TOLERANCE_M = 0.8


@dataclass(frozen=True, slots=True)
class Reposition:
    """Where to hold instead; None and NaN keep what is."""

    point: tuple[float, float] | None
    up_m: float
    speed_m_s: float = math.nan
    """For the way there only [22_reposition_quad]."""
    orbit_radius_m: float = math.nan
    """A plane's; negative is counter-clockwise."""


class HoldMode:
    """AUTO.LOITER: stop (or circle) here. `reposition` moves the held point, also before the mode is entered."""

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._wanted: Reposition | None = None
        self._came_from: tuple[float, float] | None = None
        """A plane on its straight way to the circle of a reposition."""

    def reposition(self, wanted: Reposition) -> None:
        """DO_REPOSITION, or DO_ORBIT of a plane."""
        self._wanted = wanted

    def hold_at(self, point: tuple[float, float], up_m: float) -> None:
        """A fence was breached there."""
        self._wanted = Reposition(point, up_m)

    def activate(self) -> None:
        context = self._context
        self._came_from = None
        body = context.state.body
        if context.state.status.landed:
            context.set_point(SetpointKind.IDLE, (body.north_m, body.east_m), body.up_m)
        else:
            context.set_point(SetpointKind.LOITER, context.stop_point(), self._height_m())

    def _go(self, wanted: Reposition) -> None:
        context = self._context
        point = wanted.point
        if point is None:
            holding = self._came_from is not None or context.setpoint.kind is SetpointKind.LOITER
            only_height = holding and math.isfinite(wanted.up_m)
            point = context.setpoint.point if only_height else context.stop_point()
        up_m = wanted.up_m if math.isfinite(wanted.up_m) else context.state.body.up_m
        setpoint = context.set_point(SetpointKind.LOITER, point, up_m)
        if wanted.speed_m_s > 0.0:
            setpoint.cruise_speed_m_s = wanted.speed_m_s
        if math.isfinite(wanted.orbit_radius_m):
            setpoint.loiter_radius_m, setpoint.loiter_clockwise = (
                abs(wanted.orbit_radius_m),
                wanted.orbit_radius_m > 0.0,
            )
        body = context.state.body
        self._came_from = (body.north_m, body.east_m) if context.flies_like_plane else None

    def _approach(self, came_from: tuple[float, float]) -> None:
        """Straight at the point, and from twice the circle's radius on along the circle [22_reposition_plane]."""
        context, body = self._context, self._context.state.body
        setpoint = context.setpoint
        switch_m = body.ground_speed_m_s * context.profile.switch_distance_s(context.params)
        near_m = 2.0 * max(setpoint.loiter_radius_m, switch_m)
        if math.dist((body.north_m, body.east_m), setpoint.point) > near_m:
            setpoint.kind, setpoint.previous = SetpointKind.POSITION, came_from
        else:
            setpoint.kind, setpoint.previous, self._came_from = SetpointKind.LOITER, None, None

    def _height_m(self) -> float:
        """Where it is; after a finished takeoff, where that was to end."""
        body, before = self._context.state.body, self._context.setpoint
        finished = before.kind is SetpointKind.TAKEOFF and body.up_m >= before.up_m - TAKEOFF_TOLERANCE_M
        return before.up_m if finished else body.up_m

    def step(self) -> None:
        context = self._context
        if self._wanted is not None:
            wanted, self._wanted = self._wanted, None
            self._go(wanted)
        elif context.setpoint.kind is SetpointKind.IDLE and not context.state.status.landed:
            self.activate()
        if self._came_from is not None:
            self._approach(self._came_from)
