"""What a failsafe flies, after a hold in which a user can take over (PX4's commander/failsafe/framework)."""

from __future__ import annotations

from app.simulator.clock import VehicleClock
from app.simulator.commander import Commander, StatusOutput
from app.simulator.params import Params
from app.simulator.state import Status
from app.simulator.wire import Mode, Severity

NUMBERS = {Mode.LOITER: 5, Mode.RTL: 6, Mode.LAND: 7, Mode.DESCEND: 8, Mode.TERMINATION: 10}
"""failsafe_action_t."""
SEVERITY = {Mode.LOITER: 1, Mode.RTL: 2, Mode.LAND: 3, Mode.DESCEND: 4, Mode.TERMINATION: 5}
"""Of the modes that a failsafe flies; the worst one wins, all others are 0."""
NO_DELAY_S = 0.1
"""A COM_FAIL_ACT_T up to this is none."""


class FailsafeAction:
    """Of one failsafe. A user who changes the mode has taken over, also from the hold before the action."""

    def __init__(
        self, status: Status, params: Params, clock: VehicleClock, commander: Commander, output: StatusOutput
    ) -> None:
        self._status = status
        self._params = params
        self._clock = clock
        self._commander = commander
        self._text, self._event = output
        self.clear()

    def clear(self) -> None:
        """Nothing is flown."""
        self.flown: Mode | None = None
        """Because of this failsafe, until a user changes the mode."""
        self._changes_then = 0
        self._delayed: Mode | None = None
        """What follows the hold of COM_FAIL_ACT_T."""
        self._act_at_s = 0.0
        self._cause = 0

    def step(self) -> None:
        """One cycle."""
        if not self._status.armed or self._commander.mode_changes != self._changes_then:
            self.flown = self._delayed = None
        if self._delayed is not None and self._clock.now_s >= self._act_at_s:
            mode, self._delayed = self._delayed, None
            self._enter(mode)
        if self.flown is not None and _severity(self._status.mode) < SEVERITY[self.flown]:
            self._commander.force_mode(self.flown)  # a failsafe that asks for less has ended, or has begun

    def begin(self, mode: Mode, cause: int = 0) -> None:
        """`cause`: failsafe_cause_t, 0 is generic. Hold and termination come at once, and all that adds to a failsafe
        which does more than hold.
        """
        self._cause = cause
        delay_s = float(self._params["COM_FAIL_ACT_T"])
        acts = self._status.failsafe and _severity(self._status.mode) > SEVERITY[Mode.LOITER]
        if mode is Mode.RTL and self._commander.intended is Mode.LAND:
            self.warn()
        elif mode in (Mode.LOITER, Mode.TERMINATION) or delay_s <= NO_DELAY_S or acts:
            self._enter(mode)
        else:
            if self._delayed is None:
                self._act_at_s = self._clock.now_s + delay_s
            self._delayed = mode
            self._hold_before(mode, int(delay_s + 0.5))

    def warn(self) -> None:
        """Nothing is done but to say so."""
        self._event("commander_failsafe_enter_generic_warn", self._commander.intended)
        self._text(Severity.CRITICAL, "Failsafe activated")

    def _hold_before(self, mode: Mode, seconds: int) -> None:
        name = "commander_failsafe_enter_hold" if self._cause else "commander_failsafe_enter_generic_hold"
        self._event(name, self._commander.intended, NUMBERS[mode], seconds, *self._cause_argument)
        self._text(Severity.CRITICAL, f"Failsafe activated, entering Hold for {seconds} seconds")
        self._fly(Mode.LOITER)

    def _enter(self, mode: Mode) -> None:
        name = "commander_failsafe_enter" if self._cause else "commander_failsafe_enter_generic"
        self._event(name, self._commander.intended, NUMBERS[mode], *self._cause_argument)
        self._text(Severity.CRITICAL, "Failsafe activated")
        if mode is Mode.TERMINATION:
            self._commander.terminate()
        else:
            self._fly(mode)

    @property
    def _cause_argument(self) -> tuple[int, ...]:
        return (self._cause,) if self._cause else ()

    def _fly(self, mode: Mode) -> None:
        self.flown, self._changes_then = mode, self._commander.mode_changes
        self._commander.force_mode(mode)


def _severity(mode: Mode) -> int:
    return SEVERITY.get(mode, 0)
