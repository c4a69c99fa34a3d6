"""AUTO.RTL: flies the return that RTL_TYPE chooses when the mode is entered."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from enum import Enum, auto

from app.simulator.mission.geofence import Geofence
from app.simulator.mission.store import MissionStore
from app.simulator.navigator.context import NavContext
from app.simulator.navigator.mission_mode import JumpCounter, MissionResult
from app.simulator.navigator.path_return import PathReturn
from app.simulator.navigator.return_plan import (
    FencePlanner,
    Place,
    ReturnDestination,
    Way,
    avoidance_margin_m,
    return_up_m,
)
from app.simulator.setpoint import SetpointKind
from app.simulator.wire import Cmd, Severity, VtolState

ALTITUDE_TOLERANCE_M = 0.8
ROUNDING_M = 0.01
"""Heights are said in whole metres, rounded up; this much is no metre more."""


class _Stage(Enum):
    CLIMB = auto()
    AVOID_FENCE = auto()
    """From corner to corner round the fence."""
    MOVE_TO_LOITER = auto()
    LOITER_DOWN = auto()
    """To RTL_DESCEND_ALT; what hovers comes down here only when it has to wait."""
    LOITER_HOLD = auto()
    MOVE_TO_LAND = auto()
    """A VTOL on its wing flies to the landing point and changes back there."""
    MOVE_TO_LAND_HOVER = auto()
    LAND = auto()


class DirectReturn:
    """Climb, fly to one point, wait as RTL_LAND_DELAY says, land (PX4's RtlDirect)."""

    def __init__(self, context: NavContext, fence: Callable[[], Geofence]) -> None:
        self._context = context
        self._fence = fence
        self._corners: deque[Place] = deque()
        self._corner: Place = (0.0, 0.0)
        self._stage = _Stage.CLIMB
        self._since_s = 0.0
        self._destination = (0.0, 0.0)
        self._ground_m = 0.0
        self._up_m = 0.0
        self._finished = False

    def stand(self) -> None:
        """Landed already: nothing to fly."""
        self._stage, self._finished, self._ground_m = _Stage.LAND, False, self._context.home.up_m

    def start(self, destination: tuple[float, float]) -> None:
        context = self._context
        self._destination, self._ground_m = destination, context.home.up_m
        self._corner = destination
        self._finished = False
        self._up_m = return_up_m(context, destination, self._ground_m)
        self._corners.clear()
        if context.airframe.is_rover:
            self._enter(_Stage.LAND)
        above_m, amsl_m = self._up_m - self._ground_m, context.frame.altitude_m + self._up_m
        amsl, above = (math.ceil(height_m - ROUNDING_M) for height_m in (amsl_m, above_m))
        context.text(Severity.INFO, f"RTL: start return at {amsl} m ({above} m above destination)")
        context.event("vrtl_return_at")
        if not context.airframe.is_rover:
            self._plan()
            self._enter(_Stage.CLIMB)

    def _plan(self) -> None:
        """The way round the fence, from where it is now."""
        context, fence = self._context, self._fence()
        if not context.profile.returns_round_fence or fence.first_point is None:
            return
        body = context.state.body
        planner = FencePlanner(fence, avoidance_margin_m(context))
        corners = planner.corners((body.north_m, body.east_m), self._destination)
        if corners is None:
            context.text(Severity.CRITICAL, "RTL: no geofence avoidance path; flying directly")
            context.event("rtl_avoidance_runtime_fallback")
        elif corners:
            self._corners.extend(corners)
            context.text(Severity.INFO, "RTL: avoiding geofence")
            context.event("rtl_avoiding_geofence")

    def step(self) -> None:
        if self._stage is _Stage.LAND:
            self._finish_when_landed()
        elif self._reached():
            self._enter(self._following())

    # stages -------------------------------------------------------------------------------------------------

    def _following(self) -> _Stage:
        waits = float(self._context.params["RTL_LAND_DELAY"]) != 0.0
        match self._stage:
            case _Stage.CLIMB | _Stage.AVOID_FENCE:
                return _Stage.AVOID_FENCE if self._corners else _Stage.MOVE_TO_LOITER
            case _Stage.MOVE_TO_LOITER:
                return _Stage.LOITER_DOWN if waits or self._context.flies_like_plane else _Stage.LAND
            case _Stage.LOITER_DOWN:
                return _Stage.LOITER_HOLD
            case _Stage.LOITER_HOLD if self._context.airframe.is_vtol and self._context.flies_like_plane:
                return _Stage.MOVE_TO_LAND
            case _Stage.LOITER_HOLD:
                return _Stage.MOVE_TO_LAND_HOVER
            case _Stage.MOVE_TO_LAND:
                self._context.command((Cmd.DO_VTOL_TRANSITION, (float(VtolState.MC), 0.0, 0.0, 0.0)))
                return _Stage.MOVE_TO_LAND_HOVER
            case _Stage.MOVE_TO_LAND_HOVER | _Stage.LAND:
                return _Stage.LAND

    def _enter(self, stage: _Stage) -> None:
        context = self._context
        self._stage, self._since_s = stage, context.now_s
        flies_on = context.flies_like_plane
        match stage:
            case _Stage.CLIMB:
                context.loiter_on(self._up_m)
            case _Stage.AVOID_FENCE:
                body, first = context.state.body, self._corner == self._destination
                before = (body.north_m, body.east_m) if first else self._corner
                self._corner = self._corners.popleft()
                following = self._corners[0] if self._corners else self._destination
                context.set_point(
                    SetpointKind.POSITION, self._corner, self._up_m, next_point=following, previous=before
                )
            case _Stage.MOVE_TO_LOITER:
                self._move(SetpointKind.LOITER if flies_on else SetpointKind.POSITION, self._up_m)
            case _Stage.LOITER_DOWN | _Stage.LOITER_HOLD:
                self._move(SetpointKind.LOITER, self._loiter_up_m)
                if stage is _Stage.LOITER_HOLD and float(context.params["RTL_LAND_DELAY"]) < 0.0:
                    context.text(Severity.INFO, "RTL: completed, loitering")
                    context.event("rtl_completed_loiter")
            case _Stage.MOVE_TO_LAND | _Stage.MOVE_TO_LAND_HOVER:
                self._move(SetpointKind.POSITION, self._loiter_up_m)
            case _Stage.LAND:
                context.text(Severity.INFO, "RTL: land at destination")
                context.event("rtl_land_at_destination")
                context.set_point(SetpointKind.LAND, self._destination, self._ground_m)

    def _move(self, kind: SetpointKind, up_m: float) -> None:
        setpoint = self._context.set_point(kind, self._destination, up_m)
        radius_m = float(self._context.params["RTL_LOITER_RAD"])
        setpoint.loiter_radius_m, setpoint.loiter_clockwise = abs(radius_m), radius_m >= 0.0

    @property
    def _loiter_up_m(self) -> float:
        return min(self._ground_m + float(self._context.params["RTL_DESCEND_ALT"]), self._up_m)

    # reached ------------------------------------------------------------------------------------------------

    def _reached(self) -> bool:
        context = self._context
        match self._stage:
            case _Stage.CLIMB:
                return context.state.body.up_m >= self._up_m - self._tolerance_m
            case _Stage.AVOID_FENCE:
                return self._is_at_corner()
            case _Stage.LOITER_DOWN:
                return self._is_there() and abs(context.state.body.up_m - self._loiter_up_m) <= self._tolerance_m
            case _Stage.LOITER_HOLD:
                delay_s = float(context.params["RTL_LAND_DELAY"])
                return 0.0 <= delay_s <= context.now_s - self._since_s
            case _Stage.MOVE_TO_LAND_HOVER if context.state.status.vtol_state == VtolState.TRANSITION_TO_MC:
                return False
        return self._is_there()

    def _is_at_corner(self) -> bool:
        context, body = self._context, self._context.state.body
        radius_m = float(context.params["NAV_ACC_RAD"])
        if context.flies_like_plane:
            radius_m = max(radius_m, body.ground_speed_m_s * context.profile.switch_distance_s(context.params))
        return math.dist((body.north_m, body.east_m), self._corner) <= radius_m

    def _is_there(self) -> bool:
        """NAV_ACC_RAD; a wing that circles there is there on its orbit."""
        body, setpoint = self._context.state.body, self._context.setpoint
        radius_m = float(self._context.params["NAV_ACC_RAD"])
        if self._context.flies_like_plane and setpoint.kind is SetpointKind.LOITER:
            radius_m += setpoint.loiter_radius_m
        return math.dist((body.north_m, body.east_m), self._destination) <= radius_m

    @property
    def _tolerance_m(self) -> float:
        if not self._context.flies_like_plane:
            return ALTITUDE_TOLERANCE_M
        lands_next = self._stage is _Stage.LOITER_DOWN and self._context.airframe.is_fixed_wing
        return float(self._context.params["NAV_FW_ALTL_RAD" if lands_next else "NAV_FW_ALT_RAD"])

    def _finish_when_landed(self) -> None:
        """PX4's return ends in an idle item, which is said like a command [06_quad_delivery_default]. Where it
        begins, a rover has landed for a moment.
        """
        context = self._context
        landed = context.state.status.landed and (self._is_there() or not context.airframe.is_rover)
        if landed and not self._finished:
            acceptance_m, loiter_m = (float(context.params[name]) for name in ("NAV_ACC_RAD", "NAV_LOITER_RAD"))
            amsl_m = context.frame.altitude_m + self._ground_m
            context.command((Cmd.IDLE, (0.0, acceptance_m, loiter_m, math.nan, 0.0, 0.0, amsl_m)))
        self._finished = landed


class ReturnMode:
    """`from_mission` is written by the navigator before `activate`: whether mission mode was flown until now."""

    def __init__(
        self,
        context: NavContext,
        store: MissionStore,
        result: MissionResult,
        jumps: JumpCounter,
        fence: Callable[[], Geofence],
    ) -> None:
        self.from_mission = False
        self._context = context
        self._destination = ReturnDestination(context, store, result)
        self._direct = DirectReturn(context, fence)
        self._path = PathReturn(context, store, result, jumps)
        self._flown: DirectReturn | PathReturn = self._direct

    def activate(self) -> None:
        context = self._context
        context.gimbal.start(context.now_s)
        plan = self._destination.choose()
        self._flown = self._direct if plan.way is Way.DIRECT else self._path
        if context.state.status.landed and not context.airframe.is_rover:
            body = context.state.body
            context.set_point(SetpointKind.IDLE, (body.north_m, body.east_m), body.up_m)
            self._direct.stand()
            self._flown = self._direct
        elif plan.way is Way.DIRECT:
            self._direct.start(plan.point)
        else:
            start, land = self._destination.landing_start, self._destination.landing_seq
            self._path.start(plan.way, plan.point, start, land, self.from_mission)

    def step(self) -> None:
        self._flown.step()
