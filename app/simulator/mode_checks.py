"""Which mode can run now, and whether the vehicle may be armed for it (PX4's health and arming checks)."""

from __future__ import annotations

from app.simulator.clock import VehicleClock
from app.simulator.navigator.mission_mode import MissionResult
from app.simulator.offboard.stream import OffboardStream
from app.simulator.params import Params
from app.simulator.state import Status
from app.simulator.wire import Mode

CHECKS_GOOD_S = 4.6
NEED_STICKS = frozenset({Mode.MANUAL, Mode.ALTCTL, Mode.POSCTL, Mode.ACRO, Mode.STABILIZED})
"""mode_req_manual_control. There are no sticks here, as with COM_RC_IN_MODE 4."""
PREVENT_ARMING = frozenset({Mode.RTL, Mode.LAND, Mode.ORBIT, Mode.TERMINATION})
"""mode_req_prevent_arming: nobody takes off in them."""
WITHOUT_POSITION = frozenset({Mode.MANUAL, Mode.ALTCTL, Mode.ACRO, Mode.STABILIZED, Mode.TERMINATION})


class ModeChecks:
    """Reads what others write."""

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
            return self._offboard.lives and (self._offboard.flies_blind or self._status.position_valid)
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
