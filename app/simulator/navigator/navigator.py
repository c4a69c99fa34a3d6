"""Runs the flight mode that the commander chose, and checks missions when they or the fence change."""

from __future__ import annotations

import math
from collections.abc import Callable

from app.simulator.mission.feasibility import FeasibilityInput, first_waypoint_m, problems
from app.simulator.mission.geofence import Geofence
from app.simulator.mission.store import MissionStore
from app.simulator.navigator.context import NavContext
from app.simulator.navigator.mission_mode import MissionMode
from app.simulator.navigator.modes import DescendMode, FlightMode, HoldMode, LandMode, TakeoffMode
from app.simulator.navigator.orbit_mode import OrbitMode
from app.simulator.navigator.return_mode import ReturnMode
from app.simulator.navigator.return_plan import ReturnCheck
from app.simulator.setpoint import SetpointKind
from app.simulator.state import OrbitStatus
from app.simulator.wire import Mode, Severity

FENCE_CHECK_S = 0.6
"""A changed fence is looked at this late [05_fence_rally]."""
ROUTE_CACHE_ITEMS = 500
LOOKED_UP_BY_THE_CHECK = ("FW_LND_ANG", "MIS_DIST_1WP", "MIS_TKO_LAND_REQ", "NAV_ACC_RAD")
"""PX4's FeasibilityChecker looks these up (param_find) as it checks the first mission after the boot [28]."""


class Navigator:
    """One cycle per step: mission checks, mode change, the mode itself."""

    def __init__(
        self,
        context: NavContext,
        store: MissionStore,
        mission: MissionMode,
        hold: HoldMode,
        takeoff: TakeoffMode,
        offboard: FlightMode,
        orbit: OrbitMode,
        change_mode: Callable[[Mode], None],
    ) -> None:
        self._context = context
        self._store = store
        self._mission = mission
        self._takeoff = takeoff
        self._land = LandMode(context)
        self._return = ReturnMode(context, store, mission.result, mission.jumps, lambda: self._fence)
        self._change_mode = change_mode
        self._modes: dict[Mode, FlightMode] = {
            Mode.MISSION: mission,
            Mode.LOITER: hold,
            Mode.RTL: self._return,
            Mode.LAND: self._land,
            Mode.DESCEND: DescendMode(context),
            Mode.TAKEOFF: takeoff,
            Mode.OFFBOARD: offboard,
            Mode.ORBIT: orbit,
        }
        self._orbit = orbit
        self._hold = hold
        self._active: tuple[Mode, bool, float] | None = None
        """Mode, armed, armed since: entering is all of these, so that a quick disarm and arm is seen too."""
        self._mission_serial = -1
        self._fence_serial = -1
        self._fence_due_s: float | None = None
        self._fence = self.fence_in_force = Geofence((), context.frame)
        """As stored; and as it limits flying, which it does not when it was invalid as it came."""
        self._return_check = ReturnCheck(context)

    def boot(self) -> None:
        """Power-up: everything stored is read and checked again once home is known."""
        self._active = None
        self._context.gimbal.boot()
        self._return_check.boot()
        self._mission_serial = self._fence_serial = -1
        self._mission.active = False
        self._mission.result.valid = False
        self._mission.result.started = False
        self._mission.result.finished = False
        self._mission.result.seq_reached = -1
        self._context.set_point(SetpointKind.IDLE, (0.0, 0.0), 0.0)

    def step(self) -> None:
        context = self._context
        status = context.state.status
        self._check_stored()
        self._return_check.step()
        wanted = (status.mode, status.armed, status.armed_at_s)
        if wanted != self._active:
            self._active = wanted
            self._enter(status.mode, status.armed)
        for command in context.gimbal.due(context.now_s):
            context.command(command)
        mode = self._modes.get(status.mode, self._hold)
        if not status.armed:
            self._context.state.orbit = None
            return
        mode.step()
        self._context.state.orbit = self._orbiting()
        if status.mode is Mode.TAKEOFF and self._takeoff.finished:
            self._mission.result.finished = True
            self._change_mode(Mode.LOITER)
        elif status.mode is Mode.LAND and self._land.finished:
            self._mission.result.finished = True

    def _orbiting(self) -> OrbitStatus | None:
        """A multicopter's orbit, or any loiter of a fixed wing [10_plane_delivery, 22_reposition_plane]."""
        context, setpoint = self._context, self._context.setpoint
        if context.hovers:
            return self._orbit.status if context.state.status.mode is Mode.ORBIT else None
        if not context.flies_like_plane or setpoint.kind is not SetpointKind.LOITER:
            return None
        side = 1.0 if setpoint.loiter_clockwise else -1.0
        return OrbitStatus(side * setpoint.loiter_radius_m, setpoint.point, setpoint.up_m)

    def _enter(self, mode: Mode, armed: bool) -> None:
        self._return.from_mission = self._mission.active
        self._mission.deactivate()
        self._context.cruise_speed_m_s = math.nan
        self._mission.active = mode is Mode.MISSION and armed
        if mode in (Mode.TAKEOFF, Mode.LAND):
            self._mission.result.finished = False
        if self._mission.active and self._context.state.status.landed:
            self._warn_far_first_waypoint(self._feasibility_input())
        if armed:
            self._modes.get(mode, self._hold).activate()
        else:
            body = self._context.state.body
            self._context.set_point(SetpointKind.IDLE, (body.north_m, body.east_m), body.up_m)

    # mission checks -----------------------------------------------------------------------------------------

    def _check_stored(self) -> None:
        if self._context.state.status.home is None:
            return
        now_s = self._context.now_s
        if self._store.fence_serial != self._fence_serial:
            first = self._fence_serial < 0
            self._fence_serial = self._store.fence_serial
            needs_all = self._context.profile.needs_all_inclusions
            self._fence = Geofence(self._store.fence.items, self._context.frame, needs_all=needs_all)
            self._fence_due_s = now_s if first else now_s + FENCE_CHECK_S
        if self._fence_due_s is not None and now_s >= self._fence_due_s:
            self._fence_due_s = None
            self._check_fence()
            self._return_check.take(self._fence)
            if len(self._store.mission):
                self._mission.result.valid = self._check_mission()
                self._loiter_if_invalid()
        if self._store.mission_serial != self._mission_serial:
            self._mission_serial = self._store.mission_serial
            self._take_mission()

    def _check_fence(self) -> None:
        """A fence has to have home inside, and a flying vehicle where it would act (checkHomeRequirements...)."""
        context, body = self._context, self._context.state.body
        at_home = self._fence.valid_at((context.home.north_m, context.home.east_m))
        acts = context.params.integer("GF_ACTION") > 0 and not context.state.status.landed
        self.fence_in_force = at_home.valid_at((body.north_m, body.east_m)) if acts else at_home
        if at_home.areas != self._fence.areas:
            self._refuse_fence("Geofence invalid, doesn't contain Home position", "against_home")
        elif self.fence_in_force.areas != at_home.areas:
            self._refuse_fence("Geofence invalid, doesn't contain current vehicle position", "against_cur_pos")

    def _refuse_fence(self, text: str, event: str) -> None:
        self._context.text(Severity.CRITICAL, text)
        self._context.event(f"navigator_geofence_invalid_{event}")

    def _take_mission(self) -> None:
        self._mission.result.valid = self._check_mission()
        count = len(self._store.mission)
        if count > ROUTE_CACHE_ITEMS:  # flown all the same [04_upload_1000]
            text = f"Mission with {count} items exceeds route cache capacity {ROUTE_CACHE_ITEMS}"
            self._context.text(Severity.WARNING, text)
            self._context.event("navigator_route_cache_too_large", count, ROUTE_CACHE_ITEMS)
        self._mission.mission_changed()
        self._loiter_if_invalid()

    def _loiter_if_invalid(self) -> None:
        """It is left where it is flown, also if a fence alone has changed (seen of PX4 main)."""
        if self._mission.active and not self._mission.result.valid:
            self._context.text(Severity.CRITICAL, "No valid mission available, loitering")
            self._context.event("mission_not_valid_loiter")
            self._change_mode(Mode.LOITER)

    def _check_mission(self) -> bool:
        context = self._context
        mission = self._feasibility_input()
        if mission.items:
            context.params.look_up(LOOKED_UP_BY_THE_CHECK)
        self._warn_far_first_waypoint(mission)
        found = list(problems(mission))
        for problem in found:
            if problem.text:
                context.text(Severity.CRITICAL, problem.text)
            context.event(problem.event, *problem.arguments)
        return not found and len(mission.items) > 0

    def _feasibility_input(self) -> FeasibilityInput:
        context = self._context
        return FeasibilityInput(
            items=self._store.mission.items,
            airframe=context.airframe,
            params=context.params,
            frame=context.frame,
            home=context.state.status.home,
            fence=self._fence,
            landed=context.state.status.landed,
            profile=context.profile,
        )

    def _warn_far_first_waypoint(self, mission: FeasibilityInput) -> None:
        """Said by an event only; the mission is flown all the same [14b_infeasible_more]."""
        distance_m = first_waypoint_m(mission)
        if mission.profile.judges_start:
            return
        if distance_m > float(self._context.params["MIS_DIST_1WP"]) > 0.0:
            self._context.event("navigator_mis_first_wp_far", distance_m)
