"""Loss of the position: no mode that needs one can be flown on, so the vehicle comes down blindly (PX4's Descend)."""

from __future__ import annotations

import math
from collections.abc import Callable

from app.simulator.clock import VehicleClock
from app.simulator.commander import Commander
from app.simulator.faults import VehicleFaults
from app.simulator.state import Status
from app.simulator.wire import Mode, Severity

DEAD_RECKONING_S = 5.0
"""EKF2_NOAID_TOUT: so long the estimator goes on without GNSS."""
DESCEND_ACTION = 8


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
        text: Callable[[Severity, str], None],
        event: Callable[..., None],
    ) -> None:
        self._status = status
        self._faults = faults
        self._clock = clock
        self._commander = commander
        self._text = text
        self._event = event
        self._fix_at_s = -math.inf
        self._interrupted: tuple[Mode, bool] | None = None
        """Mode and failsafe flag that the loss ended."""

    def boot(self) -> None:
        """Power-up: no position yet."""
        self._fix_at_s = -math.inf
        self._interrupted = None
        self._status.position_valid = False

    def step(self) -> None:
        """One cycle."""
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
        """HEARTBEAT shows Descend as AUTO.LAND; whatever another failsafe wants meanwhile is impossible."""
        status = self._status
        if self._interrupted is None:
            self._text(Severity.CRITICAL, "Failsafe activated")
            self._event("commander_failsafe_enter_generic", self._commander.intended, DESCEND_ACTION)
            self._interrupted = (status.mode, status.failsafe)
        elif status.mode is not Mode.LAND:
            self._interrupted = (status.mode, status.failsafe)
        if status.mode is not Mode.LAND or not status.failsafe:
            self._commander.force_mode(Mode.LAND)

    def _resume(self, mode: Mode, by_failsafe: bool) -> None:
        self._interrupted = None
        if self._status.mode is not Mode.LAND:
            return  # somebody flies it without a position
        if by_failsafe:
            self._commander.force_mode(mode)
        else:
            self._commander.resume(mode)
