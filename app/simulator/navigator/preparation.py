"""What has to happen before an item can be flown as such: climb, turn, change state, move to the landing point.

PX4's work items. Each `step` returns True when the item itself may begin.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import Enum, auto

from app.simulator.geo import wrap_pi
from app.simulator.mission.item import LAND_COMMANDS, TAKEOFF_COMMANDS, Item
from app.simulator.navigator.arrival import Arrival
from app.simulator.navigator.context import NavContext
from app.simulator.navigator.target import Target
from app.simulator.setpoint import SetpointKind
from app.simulator.wire import Cmd, Severity, VtolState

CLIMB_TOLERANCE_M = 0.8


class _Stage(Enum):
    NONE = auto()
    CLIMB = auto()
    """Straight up, because the vehicle stands on the ground."""
    ALIGN = auto()
    """A VTOL turns towards its next point before it becomes a fixed wing."""
    TRANSITION = auto()
    """A VTOL changes to fixed wing after its takeoff, or back before its landing."""
    MOVE_TO_LAND = auto()
    """What lands vertically flies to the landing point first."""


class Preparation:
    """`reached` is called where PX4 reports an item as reached long before it is done."""

    def __init__(self, context: NavContext, arrival: Arrival, reached: Callable[[], None]) -> None:
        self._context = context
        self._arrival = arrival
        self._reached = reached
        self._stage = _Stage.NONE

    @property
    def busy(self) -> bool:
        """The item itself has not begun."""
        return self._stage is not _Stage.NONE

    def cancel(self) -> None:
        """Another item begins."""
        self._stage = _Stage.NONE

    def begin(self, item: Item, target: Target, *, from_here: bool) -> bool:
        """Start what a position item needs first; False when it needs nothing.

        It climbs only where a mission is entered: after a landing amid it the item itself lifts off
        [09_quad_land_deliver].
        """
        context = self._context
        if item.command in LAND_COMMANDS:
            return self._move_to_land(target)
        runs_up = context.airframe.is_fixed_wing and item.command not in TAKEOFF_COMMANDS  # [14_infeasible_plane]
        if from_here and context.state.status.landed and (context.hovers or runs_up):
            self._climb(target)
            return True
        return False

    def begin_transition(self, item: Item, towards: Target | None) -> bool:
        """DO_VTOL_TRANSITION to fixed wing in the air: turn towards the next point first."""
        context = self._context
        to_wing = item.command == Cmd.DO_VTOL_TRANSITION and round(item.param1) == VtolState.FW
        if not to_wing or not context.airframe.is_vtol or not context.hovers or context.state.status.landed:
            return False
        self._align(towards.point if towards is not None else None)
        if towards is not None:  # the next leg's: it stops where it is while it turns
            yaw_rad = context.setpoint.yaw_rad
            context.set_point(SetpointKind.POSITION, towards.point, towards.up_m)
            context.setpoint.yaw_rad = yaw_rad
        return True

    def step(self, item: Item, target: Target | None) -> bool:
        """One cycle; True when the item may begin. `target` is None for items without a position."""
        context = self._context
        if self._stage is _Stage.ALIGN:
            return self._step_alignment(item)
        if target is None:
            return True
        if self._stage is _Stage.CLIMB:
            if context.state.body.up_m < context.setpoint.up_m - CLIMB_TOLERANCE_M:
                return False
            if item.command == Cmd.NAV_VTOL_TAKEOFF and context.hovers:
                self._align(target.point)
                return False
            return self._done()
        if self._stage is _Stage.TRANSITION:
            wanted = VtolState.MC if target.is_landing else VtolState.FW
            if context.state.status.vtol_state != wanted:
                return False
            return not (target.is_landing and self._move_to_land(target)) and self._done()
        return self._step_towards_landing(item, target)

    def _done(self) -> bool:
        self._stage = _Stage.NONE
        return True

    def _climb(self, target: Target) -> None:
        context = self._context
        body = context.state.body
        up_m = max(target.up_m, body.up_m + float(context.params["MIS_TAKEOFF_ALT"]))
        above_home_m = up_m - context.home.up_m
        context.text(Severity.INFO, f"Climb to {above_home_m:.1f} meters above home")
        context.event("mission_climb_before_start", above_home_m)
        self._stage = _Stage.CLIMB
        here = (body.north_m, body.east_m)
        context.set_point(SetpointKind.TAKEOFF, target.point if context.flies_like_plane else here, up_m, previous=here)

    def _move_to_land(self, target: Target) -> bool:
        context = self._context
        body = context.state.body
        here = (body.north_m, body.east_m)
        lands_vertically = context.airframe.is_multicopter or context.airframe.is_vtol
        near = math.dist(here, target.point) <= target.acceptance_radius_m
        if not lands_vertically or (near and not context.flies_like_plane):
            return False
        self._stage = _Stage.MOVE_TO_LAND
        self._arrival.start()
        if not context.flies_like_plane:
            context.gimbal.start(context.now_s)
        context.set_point(SetpointKind.POSITION, target.point, max(body.up_m, target.up_m), previous=here)
        return True

    def _step_towards_landing(self, item: Item, target: Target) -> bool:
        context = self._context
        body = context.state.body
        if math.dist((body.north_m, body.east_m), target.point) > self._arrival.switch_radius_m(target):
            return False
        self._reached()  # [12_vtol_delivery]
        if context.flies_like_plane:
            self._change_state(VtolState.MC, item)
            return False
        return self._done()

    def _align(self, point: tuple[float, float] | None) -> None:
        body = self._context.state.body
        self._stage = _Stage.ALIGN
        if point is not None:
            self._context.setpoint.yaw_rad = math.atan2(point[1] - body.east_m, point[0] - body.north_m)

    def _step_alignment(self, item: Item) -> bool:
        context = self._context
        missing = wrap_pi(context.setpoint.yaw_rad - context.state.body.yaw_rad)
        if math.isfinite(missing) and abs(missing) > math.radians(float(context.params["MIS_YAW_ERR"])):
            return False
        self._reached()  # long before a transition item is done, too [12_vtol_delivery]
        if not item.has_position:
            return self._done()
        self._change_state(VtolState.FW, item)
        return False

    def _change_state(self, wanted: VtolState, item: Item) -> None:
        """PX4 makes the item into a transition and keeps the rest of it: no yaw, and its height as param7."""
        self._stage = _Stage.TRANSITION
        if self._context.setpoint.kind is SetpointKind.TAKEOFF:  # the takeoff is over [25_land_detector_vtol]
            self._context.setpoint.kind = SetpointKind.POSITION
        self._context.command((Cmd.DO_VTOL_TRANSITION, (float(wanted), 0.0, 0.0, item.param4, 0.0, 0.0, item.z)))
