"""Failsafes: a low battery, a lost position, a lost ground station; and the warning that a mode cannot run."""

from __future__ import annotations

import math
from collections.abc import Callable

from app.simulator.clock import VehicleClock
from app.simulator.commander import Commander, ModeChecks, StatusOutput
from app.simulator.failsafe_action import NUMBERS, FailsafeAction
from app.simulator.faults import VehicleFaults
from app.simulator.params import Params
from app.simulator.state import Status
from app.simulator.wire import Mode, Severity

ENDURANCE_S = 1500.0
"""Flying time from full to empty."""
CRITICAL, EMERGENCY = 2, 3
CAUSES = {CRITICAL: 4, EMERGENCY: 5}
"""failsafe_cause_t."""
LOW_BATTERY_ACTIONS = {
    1: {CRITICAL: Mode.RTL, EMERGENCY: Mode.RTL},
    2: {CRITICAL: Mode.LAND, EMERGENCY: Mode.LAND},
    3: {CRITICAL: Mode.RTL, EMERGENCY: Mode.LAND},
}
"""COM_LOW_BAT_ACT to level to what is flown; else it is only said."""


class Battery:
    """Each level is announced once, until the battery is changed, and acts once, when the vehicle flies.

    As in PX4 a level that was there when the vehicle was armed (by force) is only said, and a user who changed the mode
    has taken over until the next level.
    """

    def __init__(
        self,
        status: Status,
        params: Params,
        action: FailsafeAction,
        text: Callable[[Severity, str], None],
    ) -> None:
        self._status = status
        self._params = params
        self._action = action
        self._text = text
        self._announced = 0
        self._acted = 0
        self._was_armed = False

    def set_fraction(self, fraction: float) -> None:
        """Somebody changed the battery, or a fault did."""
        self._status.battery_fraction = max(0.0, min(1.0, fraction))
        if self._level() == 0:
            self._announced = self._acted = 0

    def step(self) -> None:
        self._action.step()
        status = self._status
        if status.armed:
            status.battery_fraction = max(0.0, status.battery_fraction - VehicleClock.STEP_S / ENDURANCE_S)
        level = self._level()
        status.battery_warning = max(level, status.battery_warning) if status.armed else level
        if status.armed and not self._was_armed:
            self._acted = level
        self._was_armed = status.armed
        if level > self._announced and status.armed:
            self._announced = level
            self._announce(level)
        if level > self._acted and status.armed and not status.landed:
            self._acted = level
            self._act(level)

    def _level(self) -> int:
        fraction, params = self._status.battery_fraction, self._params
        low, critical = fraction <= params["BAT_LOW_THR"], fraction <= params["BAT_CRIT_THR"]
        return low + critical + (fraction <= params["BAT_EMERGEN_THR"])

    def _announce(self, level: int) -> None:
        name = ("", "Low", "Critical", "Emergency")[level]
        self._text(Severity.WARNING if level == 1 else Severity.CRITICAL, f"{name} battery level")

    def _act(self, level: int) -> None:
        mode = LOW_BATTERY_ACTIONS.get(self._params.integer("COM_LOW_BAT_ACT"), {}).get(level)
        if mode is not None:
            self._action.begin(mode, CAUSES[level])


# Loss of the position: no mode that needs one can be flown on, so the vehicle comes down blindly (PX4's Descend).


DEAD_RECKONING_S = 5.0
"""EKF2_NOAID_TOUT: so long the estimator goes on without GNSS."""


class PositionLossFailsafe:
    """Writes `status.gps_lost` and `status.position_valid`. Return, hold and land need a position, too.

    PX4's mode fallback: with the position back the vehicle goes on in the mode that it had.
    """

    def __init__(
        self,
        status: Status,
        faults: VehicleFaults,
        clock: VehicleClock,
        commander: Commander,
        output: StatusOutput,
    ) -> None:
        self._status = status
        self._faults = faults
        self._clock = clock
        self._commander = commander
        self._text, self._event = output
        self._fix_at_s = -math.inf
        self._interrupted: tuple[Mode, bool] | None = None
        """Mode and failsafe flag that the loss ended."""

    def boot(self) -> None:
        """Power-up: no position yet."""
        self._fix_at_s = -math.inf
        self._interrupted = None
        self._status.position_valid = False

    def step(self) -> None:
        status, now_s = self._status, self._clock.now_s
        status.gps_lost = self._faults.gps_lost
        if not status.gps_lost:
            self._fix_at_s = now_s
        status.position_valid = now_s - self._fix_at_s <= DEAD_RECKONING_S
        if not status.armed:
            self._interrupted = None
        elif not status.position_valid and not self._commander.flies_blind:
            self._descend()
        elif status.position_valid and self._interrupted is not None:
            self._resume(*self._interrupted)

    def _descend(self) -> None:
        """Whatever another failsafe wants meanwhile is impossible."""
        status = self._status
        if self._interrupted is None:
            self._text(Severity.CRITICAL, "Failsafe activated")
            self._event("commander_failsafe_enter_generic", self._commander.intended, NUMBERS[Mode.DESCEND])
        if status.mode is not Mode.DESCEND:
            self._interrupted = (status.mode, status.failsafe)
            self._commander.force_mode(Mode.DESCEND)

    def _resume(self, mode: Mode, by_failsafe: bool) -> None:
        self._interrupted = None
        if self._status.mode is not Mode.DESCEND:
            return  # somebody flies it without a position
        if by_failsafe:
            self._commander.force_mode(mode)
        else:
            self._commander.resume(mode)


# Loss of the ground station: NAV_DLL_ACT after COM_DL_LOSS_T without a GCS heartbeat [24_link_loss].


HEARTBEAT_TIMEOUT_S = 2.4
"""Until the link counts as silent; COM_DL_LOSS_T comes on top."""
LINK_LOSS_ACTIONS = {1: Mode.LOITER, 2: Mode.RTL, 3: Mode.LAND}
TERMINATE, DISARM = 5, 6
"""The motors stop at once: these actions are neither delayed nor can anybody take over."""
CAUSE_GCS = 2
"""failsafe_cause_t."""
LEFT_ALONE = frozenset({Mode.RTL, Mode.LAND, Mode.DESCEND})


class LinkLossFailsafe:
    """Hold for COM_FAIL_ACT_T, then the action. When the link comes back nothing is resumed."""

    def __init__(
        self,
        status: Status,
        params: Params,
        clock: VehicleClock,
        commander: Commander,
        output: StatusOutput,
    ) -> None:
        self._status = status
        self._params = params
        self._clock = clock
        self._commander = commander
        self._text, self._event = output
        self._heard_at_s: float | None = None
        self._act_at_s: float | None = None
        clock.on_speed(self._change_speed)

    def boot(self) -> None:
        """No ground station has been heard."""
        self._heard_at_s = None
        self._act_at_s = None
        self._status.gcs_lost = True

    def on_gcs_heartbeat(self) -> None:
        """A ground station lives."""
        if self._status.gcs_lost and self._heard_at_s is not None:
            self._text(Severity.INFO, "GCS connection regained")
            self._event("commander_dl_regained")
        self._heard_at_s = self._clock.now_s
        self._status.gcs_lost = False
        self._act_at_s = None

    def _change_speed(self, factor: float) -> None:
        if self._heard_at_s is not None:
            self._heard_at_s = self._clock.same_by_the_wall(self._heard_at_s, factor)

    def step(self) -> None:
        if self._heard_at_s is not None and not self._status.gcs_lost:
            limit_s = float(self._params["COM_DL_LOSS_T"]) + HEARTBEAT_TIMEOUT_S * self._clock.speed
            if self._clock.now_s - self._heard_at_s > limit_s:
                self._lose()
        self._status.gcs_loss_counts = (
            self._status.gcs_lost
            and self._params.integer("NAV_DLL_ACT") in (*LINK_LOSS_ACTIONS, TERMINATE, DISARM)
            and self._commander.intended is not Mode.LAND
        )
        if self._act_at_s is not None and self._clock.now_s >= self._act_at_s:
            self._act_at_s = None
            action = LINK_LOSS_ACTIONS.get(self._params.integer("NAV_DLL_ACT"))
            if action is not None and self._status.armed and self._status.mode is Mode.LOITER:
                self._text(Severity.CRITICAL, "Failsafe activated")
                self._event("commander_failsafe_enter", self._commander.intended, NUMBERS[action], CAUSE_GCS)
                self._commander.force_mode(action)

    @property
    def _lands(self) -> bool:
        return self._status.mode in (Mode.LAND, Mode.DESCEND)

    def _lose(self) -> None:
        self._status.gcs_lost = True
        self._event("commander_gcs_lost")
        action = self._params.integer("NAV_DLL_ACT")
        if action in (TERMINATE, DISARM) and self._status.armed and not self._lands:
            self._text(Severity.CRITICAL, "Failsafe activated")
            if action == TERMINATE:
                self._commander.terminate()
            else:
                self._commander.disarm_by_failsafe()
            return
        acts = action in LINK_LOSS_ACTIONS
        if not acts or not self._status.armed or self._status.landed or self._status.mode in LEFT_ALONE:
            return
        self._text(Severity.CRITICAL, "Failsafe activated")
        self._event("commander_failsafe_enter_hold", Mode.MISSION, 6, 5, CAUSE_GCS)
        self._commander.force_mode(Mode.LOITER)
        self._act_at_s = self._clock.now_s + float(self._params["COM_FAIL_ACT_T"])


class ModeWarning:
    """Says by an EVENT, disarmed, that the wanted mode cannot run now [01_connect; 18_offboard_quad: landed]."""

    def __init__(self, status: Status, commander: Commander, checks: ModeChecks, event: Callable[..., None]) -> None:
        self._status = status
        self._commander = commander
        self._checks = checks
        self._event = event
        self.boot()

    def boot(self) -> None:
        """Power-up: what is said in the first moment reaches no link."""
        self._impossible = True
        self._failsafe = False

    def step(self) -> None:
        """One cycle. A failsafe that has flown has said it already [21_offboard_rover]."""
        status, mode = self._status, self._commander.intended
        impossible = not status.armed and not self._checks.is_possible(mode)
        if impossible and not self._impossible and not self._failsafe:
            self._event("commander_failsafe_enter_generic_warn", mode)
        self._impossible, self._failsafe = impossible, status.failsafe
