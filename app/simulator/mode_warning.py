"""Says, disarmed, that the wanted mode cannot run now (PX4's mode fallback; there is nothing to fall back to)."""

from __future__ import annotations

from collections.abc import Callable

from app.simulator.commander import Commander
from app.simulator.mode_checks import ModeChecks
from app.simulator.state import Status


class ModeWarning:
    """By an EVENT alone [01_connect: mission mode without a mission; 18_offboard_quad: OFFBOARD after a landing]."""

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
