"""A fence breached in flight: looked at five times a second, and what GF_ACTION does then.

PX4's Navigator::geofence_breach_check, the commander's geofence check and its failsafe. Nothing is predicted
(GF_PREDICT 0): the vehicle is over the border when it is seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from app.simulator.clock import VehicleClock
from app.simulator.commander import Commander, StatusOutput
from app.simulator.mission.geofence import Geofence
from app.simulator.params import Params
from app.simulator.state import Home, VehicleState
from app.simulator.wire import Mode, Severity

CHECK_S = 0.2
HOLD, RETURN, TERMINATE, LAND = 2, 3, 4, 5
"""GF_ACTION; 0 does not look at all, 1 only warns."""
MODES = {RETURN: Mode.RTL, LAND: Mode.LAND}
"""Of the actions that a hold of COM_FAIL_ACT_T comes before."""
EVENT_NUMBERS = {HOLD: 5, RETURN: 6, TERMINATE: 10, LAND: 7}
"""failsafe_action_t."""
SEVERITY = {Mode.LOITER: 1, Mode.RTL: 2, Mode.LAND: 3, Mode.TERMINATION: 4}
"""Of the modes that a failsafe flies; the worst one wins, all others are 0."""
TEXTS = {
    "check_gf_violation_max_hor_dist": "Geofence: exceeding maximum distance to Home",
    "check_gf_violation_max_alt": "Geofence: exceeding maximum altitude above Home",
    "check_gf_violation_custom_gf": "Geofence: approaching or outside geofence",
}
"""By their events, in the order of PX4's check."""
TEXT_BEFORE_V1_15 = "Approaching on Geofence"


def breaches_at(
    point: tuple[float, float], up_m: float, params: Params, home: Home | None, fence: Geofence
) -> list[str]:
    """The events of what is exceeded there (checkPointAgainstAllGeofences)."""
    far_m, high_m = float(params["GF_MAX_HOR_DIST"]), float(params["GF_MAX_VER_DIST"])
    found = (
        home is not None and 0.0 < far_m <= math.dist(point, (home.north_m, home.east_m)),
        home is not None and 0.0 < high_m <= up_m - home.up_m,
        not fence.allows(point),
    )
    return [name for name, exceeded in zip(TEXTS, found, strict=True) if exceeded]


class GeofenceBreach:
    """Writes `status.fence_breached`. A user who changes the mode afterwards has taken over, until the next breach."""

    def __init__(
        self,
        state: VehicleState,
        params: Params,
        clock: VehicleClock,
        commander: Commander,
        fence: Callable[[], Geofence],
        hold_at: Callable[[tuple[float, float], float], None],
        output: StatusOutput,
        names_limit: bool,
    ) -> None:
        self._state = state
        self._params = params
        self._clock = clock
        self._commander = commander
        self._fence = fence
        self._hold_at = hold_at
        self._text, self._event = output
        self._names_limit = names_limit
        self.boot()

    def boot(self) -> None:
        """Power-up."""
        self._state.status.fence_breached = False
        self._due_s = 0.0
        self._acting: Mode | None = None
        """What is flown because of the breach, until a user changes the mode."""
        self._changes_then = 0
        self._delayed: int | None = None
        """The action that follows COM_FAIL_ACT_T of hold."""
        self._act_at_s = math.inf

    def step(self) -> None:
        if not self._state.status.armed or self._commander.mode_changes != self._changes_then:
            self._acting = self._delayed = None
        if self._clock.now_s >= self._due_s and self._state.status.position_valid:
            self._due_s = self._clock.now_s + CHECK_S
            self._check()
        if self._delayed is not None and self._clock.now_s >= self._act_at_s:
            action, self._delayed = self._delayed, None
            self._report_failsafe(action)
            self._fly(MODES[action])
        if self._acting is not None and SEVERITY.get(self._state.status.mode, 0) < SEVERITY[self._acting]:
            self._commander.force_mode(self._acting)  # a failsafe that asks for less has ended, or has begun

    def _check(self) -> None:
        status = self._state.status
        breaches = list(self._breaches()) if self._params.integer("GF_ACTION") > 0 else []
        if breaches and not status.fence_breached:
            status.fence_breached = True
            self._report_breaches(breaches)
            if status.armed:
                self._act(self._params.integer("GF_ACTION"))
        elif not breaches and not self._holds_at_border:
            status.fence_breached = False

    @property
    def _holds_at_border(self) -> bool:
        """While it holds after a breach nothing is cleared: it may drift to and fro over the border."""
        return self._acting is Mode.LOITER and self._state.status.mode is Mode.LOITER

    def _breaches(self) -> list[str]:
        """The events of what is exceeded."""
        body = self._state.body
        return breaches_at((body.north_m, body.east_m), body.up_m, self._params, self._state.status.home, self._fence())

    def _report_breaches(self, breaches: list[str]) -> None:
        if not self._names_limit:
            self._text(Severity.CRITICAL, TEXT_BEFORE_V1_15)
            return
        for name in breaches:
            self._event(name)
            self._text(Severity.CRITICAL, TEXTS[name])

    # the failsafe -------------------------------------------------------------------------------------------

    def _act(self, action: int) -> None:
        """Return and land begin with a hold of COM_FAIL_ACT_T, in which a user can take over; hold comes at once."""
        delay_s = float(self._params["COM_FAIL_ACT_T"])
        body = self._state.body
        if action == TERMINATE:
            self._report_failsafe(action)
            self._commander.terminate()
        elif action == HOLD:
            self._report_failsafe(action)
            self._hold_at((body.north_m, body.east_m), body.up_m)
            self._fly(Mode.LOITER)
        elif action not in MODES or (action == RETURN and self._commander.intended is Mode.LAND):
            self._event("commander_failsafe_enter_generic_warn", self._commander.intended)
            self._text(Severity.CRITICAL, "Failsafe activated")
        elif delay_s > 0.1:
            self._delayed, self._act_at_s = action, self._clock.now_s + delay_s
            seconds = int(delay_s + 0.5)
            number = EVENT_NUMBERS[action]
            self._event("commander_failsafe_enter_generic_hold", self._commander.intended, number, seconds)
            self._text(Severity.CRITICAL, f"Failsafe activated, entering Hold for {seconds} seconds")
            self._fly(Mode.LOITER)
        else:
            self._report_failsafe(action)
            self._fly(MODES[action])

    def _report_failsafe(self, action: int) -> None:
        self._event("commander_failsafe_enter_generic", self._commander.intended, EVENT_NUMBERS[action])
        self._text(Severity.CRITICAL, "Failsafe activated")

    def _fly(self, mode: Mode) -> None:
        self._acting, self._changes_then = mode, self._commander.mode_changes
        self._commander.force_mode(mode)
