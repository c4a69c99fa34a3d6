"""The commander: modes, arming, disarming, home. What PX4 accepts when, and what it says then."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from app.simulator.clock import VehicleClock
from app.simulator.navigator.mission_mode import MissionResult
from app.simulator.offboard.receiver import OffboardStream
from app.simulator.options import MAX_LIVE_SPEED
from app.simulator.params import Params
from app.simulator.state import Home, Status, VehicleState
from app.simulator.wire import LandedState, Mode, Result, Severity, SystemStatus

CHECKS_GOOD_S = 4.6
NEED_STICKS = frozenset({Mode.MANUAL, Mode.ALTCTL, Mode.POSCTL, Mode.ACRO, Mode.STABILIZED})
"""mode_req_manual_control. There are no sticks here, as with COM_RC_IN_MODE 4."""
PREVENT_ARMING = frozenset({Mode.RTL, Mode.LAND, Mode.ORBIT, Mode.TERMINATION})
"""mode_req_prevent_arming: nobody takes off in them."""
WITHOUT_POSITION = frozenset({Mode.MANUAL, Mode.ALTCTL, Mode.ACRO, Mode.STABILIZED, Mode.TERMINATION})


class ModeChecks:
    """Which mode can run now, and whether the vehicle may be armed for it (PX4's health and arming checks)."""

    def __init__(
        self, status: Status, params: Params, clock: VehicleClock, mission: MissionResult, offboard: OffboardStream
    ) -> None:
        self._status = status
        self._params = params
        self._clock = clock
        self._mission = mission
        self._offboard = offboard

    def can_run(self, mode: Mode) -> bool:
        """Whether an armed vehicle can change to `mode`."""
        return mode not in NEED_STICKS and self.is_possible(mode)

    def is_possible(self, mode: Mode) -> bool:
        """The same, but for the sticks."""
        if mode is Mode.MISSION:
            return self._mission.valid and self._status.position_valid
        if mode is Mode.OFFBOARD:
            return self._offboard.is_seen and (self._offboard.flies_blind or self._status.position_valid)
        return self._status.position_valid or mode in WITHOUT_POSITION

    def may_arm(self, mode: Mode) -> bool:
        """Whether all checks pass for arming in `mode`."""
        status = self._status
        if mode in PREVENT_ARMING or self._clock.now_s < CHECKS_GOOD_S or status.home is None:
            return False
        if status.gps_lost and self._params.integer("COM_ARM_WO_GPS") == 0:
            return False
        if self._params.integer("NAV_DLL_ACT") > 0 and status.gcs_lost:
            return False
        if status.battery_fraction <= float(self._params["BAT_CRIT_THR"]):
            return False
        return not status.fence_breached and self.can_run(mode)

    @property
    def flies_blind(self) -> bool:
        """The mode flown now needs no position: OFFBOARD by attitude (and TERMINATION, which flies nothing)."""
        mode = self._status.mode
        return mode is Mode.TERMINATION or (mode is Mode.OFFBOARD and self._offboard.flies_blind)


HOME_KNOWN_S = 2.3
HOME_MOVED_M = 1.0
FORCE_MAGIC = 21196.0
BY_COMMAND, BY_LANDING, BY_PREFLIGHT, BY_FAILSAFE = 4, 6, 7, 14
"""ARM_DISARM_REASON, the argument of the events."""
FORGOTTEN_AFTER_DISARMING = (PREVENT_ARMING - {Mode.TERMINATION}) | {Mode.TAKEOFF}
"""Disarming leaves them for the mode that was wanted before (UserModeIntention.cpp)."""

MODE_NAMES = {Mode.LOITER: "Hold", Mode.RTL: "Return", Mode.POSCTL: "Position", Mode.ALTCTL: "Altitude"}

Event = Callable[..., None]
Text = Callable[[Severity, str], None]


class StatusOutput(NamedTuple):
    """How a component speaks: a STATUSTEXT for people, an EVENT for programs."""

    text: Text
    event: Event


class Commander:
    """Owns `status.mode`, `status.intended` and `status.armed`."""

    def __init__(
        self,
        state: VehicleState,
        params: Params,
        clock: VehicleClock,
        mission: MissionResult,
        offboard: OffboardStream,
        checks: ModeChecks,
        output: StatusOutput,
        is_ground_vehicle: bool = False,
    ) -> None:
        self._state = state
        self._params = params
        self._clock = clock
        self._mission = mission
        self._offboard = offboard
        self._checks = checks
        self._text, self._event = output
        self._is_ground_vehicle = is_ground_vehicle
        self.mode_changes = 0
        """Counts what users and the ends of modes changed; failsafes do not count."""
        self._mode_after_disarming = Mode.LOITER
        self._terminated = False
        self._home_is_set = False
        self._flown = False
        """Taken off since arming."""
        self._awaits_takeoff_s = 0.0
        self._landed_at_s = 0.0
        self._was_landed = True
        clock.on_speed(self._change_speed)

    def boot(self) -> None:
        """Power-up: disarmed, hold, nothing known."""
        status = self._state.status
        status.armed = False
        status.failsafe = False
        status.home = None
        status.system_status = SystemStatus.UNINIT
        status.mode = status.intended = self._mode_after_disarming = Mode.LOITER
        self._terminated = False
        self._home_is_set = False

    # modes --------------------------------------------------------------------------------------------------

    def set_mode(self, mode: Mode) -> Result:
        """DO_SET_MODE. Disarmed every mode is taken; armed only one that can run.

        No PX4 rule: OFFBOARD is refused where simulated time runs too fast for it.
        """
        if mode is Mode.OFFBOARD and self._offboard.too_fast:
            limit, speed = f"{MAX_LIVE_SPEED:g}x", f"{self._clock.speed:g}x"
            self._text(Severity.CRITICAL, f"Offboard refused: simulated at {speed}, limit {limit}")
            return Result.TEMPORARILY_REJECTED
        if not self._takes(mode):
            return self._not_available(mode)
        self.change_mode(mode)
        return Result.ACCEPTED

    def _takes(self, mode: Mode) -> bool:
        """A terminated flight fails all checks."""
        return not self._state.status.armed or (not self._terminated and self._checks.can_run(mode))

    def _not_available(self, mode: Mode) -> Result:
        self._text(Severity.CRITICAL, f"Switching to {_mode_name(mode)} is currently not available")
        self._event("commander_modeswitch_not_avail", mode)
        return Result.TEMPORARILY_REJECTED

    def change_mode(self, mode: Mode) -> None:
        """Change without a question: the user's intention, a command already checked, or the end of a mode."""
        self.mode_changes += 1
        self._state.status.intended = mode
        if mode not in FORGOTTEN_AFTER_DISARMING:
            self._mode_after_disarming = mode
        self.resume(mode)

    def resume(self, mode: Mode) -> None:
        """A failsafe is over: fly the user's mode again. Termination never is."""
        status = self._state.status
        if not self._terminated:
            status.mode = mode
            status.failsafe = False

    def return_to_launch(self) -> Result:
        """NAV_RETURN_TO_LAUNCH, as a command or as a mission item."""
        if not self._takes(Mode.RTL):
            return self._not_available(Mode.RTL)
        self._text(Severity.INFO, "Returning to launch")
        self._event("commander_rtl")
        self.change_mode(Mode.RTL)
        return Result.ACCEPTED

    def land(self) -> Result:
        """NAV_LAND as a command."""
        if not self._takes(Mode.LAND):
            return self._not_available(Mode.LAND)
        self._text(Severity.INFO, "Landing at current position")
        self._event("commander_landing_current_pos")
        self.change_mode(Mode.LAND)
        return Result.ACCEPTED

    def force_mode(self, mode: Mode) -> None:
        """A failsafe takes the controls; the intention stays."""
        self._state.status.mode = Mode.TERMINATION if self._terminated else mode
        self._state.status.failsafe = True

    def terminate(self) -> None:
        """A failsafe stops the motors in flight. It stays so until a reboot, armed or not, whatever is commanded."""
        self._terminated = True
        self.force_mode(Mode.TERMINATION)

    def unsupported_mode(self) -> Result:
        """DO_SET_MODE with a sub mode that does not exist."""
        self._text(Severity.CRITICAL, "Unsupported auto mode")
        self._event("commander_unsupported_auto_mode")
        return Result.TEMPORARILY_REJECTED

    @property
    def intended(self) -> Mode:
        """The user's mode; a failsafe may fly another."""
        return self._state.status.intended

    @property
    def flies_blind(self) -> bool:
        """The mode flown now needs no position."""
        return self._checks.flies_blind

    def mission_start(self) -> Result:
        """MISSION_START: mission mode, and arm, if that was possible in the mode before; refused, the mode stays so
        [26_offboard_then_return].
        """
        if not self._mission.valid:
            self._text(Severity.CRITICAL, "Mission start denied! No valid mission")
            self._event("commander_mission_start_denied_no_mission")
            return Result.DENIED
        checks_good = self.checks_good
        self.change_mode(Mode.MISSION)
        if self._arm(checks_good) is Result.ACCEPTED:
            return Result.ACCEPTED
        return self._not_available(Mode.MISSION)

    # arming -------------------------------------------------------------------------------------------------

    @property
    def checks_good(self) -> bool:
        """All arming checks pass for the intended mode."""
        return not self._terminated and self._checks.may_arm(self.intended)

    def arm(self, force: bool) -> Result:
        """COMPONENT_ARM_DISARM 1."""
        return self._arm(force or self.checks_good)

    def _arm(self, allowed: bool) -> Result:
        status = self._state.status
        if status.armed:
            return Result.ACCEPTED
        if not allowed:
            self._text(Severity.CRITICAL, "Arming denied: Resolve system health failures first")
            self._event("commander_arm_denied_resolve_failures")
            return Result.TEMPORARILY_REJECTED
        status.armed = True
        status.armed_at_s = self._awaits_takeoff_s = self._clock.now_s
        self._flown = False
        self._was_landed = status.landed
        self._set_home()
        self._text(Severity.INFO, "Armed by external command")
        self._event("commander_armed_by", BY_COMMAND)
        return Result.ACCEPTED

    def disarm(self, force: bool) -> Result:
        """COMPONENT_ARM_DISARM 0: refused in the air unless forced; what drives may stop at any time [13]."""
        status = self._state.status
        if not status.armed:
            return Result.ACCEPTED
        landed = status.landed or status.land.maybe_landed or self._is_ground_vehicle
        if not force and not landed and status.landed_state != LandedState.UNDEFINED:
            self._text(Severity.CRITICAL, "Disarming denied: not landed")
            self._event("commander_disarm_denied_not_landed")
            return Result.TEMPORARILY_REJECTED
        self._disarm("external command", BY_COMMAND)
        return Result.ACCEPTED

    def disarm_by_failsafe(self) -> None:
        """In the air too."""
        self._disarm("failsafe", BY_FAILSAFE)

    def _disarm(self, by: str, reason: int) -> None:
        status = self._state.status
        status.armed = False
        status.failsafe = False
        self._text(Severity.INFO, f"Disarmed by {by}")
        self._event("commander_disarmed_by", reason)
        status.intended = self._mode_after_disarming
        status.mode = Mode.TERMINATION if self._terminated else self.intended

    # every cycle --------------------------------------------------------------------------------------------

    def step(self) -> None:
        """Home and arming checks after boot, taking off and landing, automatic mode changes and disarming."""
        status = self._state.status
        if (status.home is None and self._clock.now_s >= HOME_KNOWN_S) or self._stands_elsewhere():
            self._set_home()
        self._follow_landing()
        if status.armed:
            self._end_of_mode()
            self._auto_disarm()
        if status.mode is Mode.TERMINATION:
            status.system_status = SystemStatus.FLIGHT_TERMINATION
        elif status.armed:
            status.system_status = SystemStatus.CRITICAL if status.in_failsafe else SystemStatus.ACTIVE
        else:
            status.system_status = SystemStatus.STANDBY if self.checks_good else SystemStatus.UNINIT

    def _stands_elsewhere(self) -> bool:
        """Home follows a vehicle that is disarmed and has landed; in the air it does not [14_infeasible_plane]."""
        status, body = self._state.status, self._state.body
        if status.home is None or status.armed or not status.landed or self._home_is_set:
            return False
        home = (status.home.north_m, status.home.east_m, status.home.up_m)
        return math.dist(home, (body.north_m, body.east_m, body.up_m)) > HOME_MOVED_M

    def set_home(self, place: Home | None) -> Result:
        """DO_SET_HOME. A place that is given stays home, even as it arms, until a reboot or a command without one."""
        if not self._state.status.position_valid:
            return Result.TEMPORARILY_REJECTED
        self._home_is_set = False
        self._set_home()
        if place is not None:
            self._home_is_set, self._state.status.home = True, place
        return Result.ACCEPTED

    def _set_home(self) -> None:
        if self._home_is_set or not self._state.status.position_valid:
            return
        body = self._state.body
        self._state.status.home = Home(body.north_m, body.east_m, body.up_m, body.yaw_rad, self._clock.now_s)

    def _follow_landing(self) -> None:
        landed = self._state.status.landed
        if landed == self._was_landed or not self._state.status.armed:
            return
        self._was_landed = landed
        if not landed and self._state.status.mode is not Mode.MISSION:
            self._set_home()  # a plane runs up some metres before [22_reposition_plane; not so in 10_plane_delivery]
        if landed:
            self._landed_at_s = self._clock.now_s
            self._text(Severity.INFO, "Landing detected")
            self._event("commander_landing_detected")
        else:
            self._flown = True
            self._text(Severity.INFO, "Takeoff detected")
            self._event("commander_takeoff_detected")

    def _end_of_mode(self) -> None:
        """A finished mission in the air goes over to hold."""
        if self._state.status.mode is Mode.MISSION and self._mission.finished and not self._state.status.landed:
            self.change_mode(Mode.LOITER)

    def _change_speed(self, factor: float) -> None:
        """Time runs slower: who is about to order the take-off has taken only so long by the wall."""
        self._awaits_takeoff_s = self._clock.same_by_the_wall(self._awaits_takeoff_s, min(factor, 1.0))

    def _auto_disarm(self) -> None:
        """COM_DISARM_LAND after a landing, but not amid a mission; COM_DISARM_PRFLT without a take-off."""
        status = self._state.status
        if not status.landed:
            return
        if not self._flown:
            limit_s = float(self._params["COM_DISARM_PRFLT"])
            if 0.0 < limit_s <= self._clock.now_s - self._awaits_takeoff_s:
                self._disarm("auto preflight disarming", BY_PREFLIGHT)
            return
        in_mission = status.mode is Mode.MISSION
        if in_mission and not self._mission.finished:
            return
        limit_s = float(self._params["COM_DISARM_LAND"])
        wait_s = 0.0 if in_mission else limit_s
        if limit_s > 0.0 and self._clock.now_s - self._landed_at_s >= wait_s:
            self._disarm("landing", BY_LANDING)


def _mode_name(mode: Mode) -> str:
    """As PX4's texts name a mode."""
    return MODE_NAMES.get(mode, mode.name.title())


def is_force(param2: float) -> bool:
    """The magic number of a forced arming or disarming."""
    return math.isclose(param2, FORCE_MAGIC)
