"""A fence breached in flight: looked at five times a second, and what GF_ACTION does then.

PX4's Navigator::geofence_breach_check, the commander's geofence check and its failsafe. Nothing is predicted
(GF_PREDICT 0): the vehicle is over the border when it is seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from app.simulator.clock import VehicleClock
from app.simulator.commander import StatusOutput
from app.simulator.failsafe_action import FailsafeAction
from app.simulator.mission.geofence import Geofence
from app.simulator.params import Params
from app.simulator.state import Home, VehicleState
from app.simulator.wire import Mode, Severity

CHECK_S = 0.2
HOLD, RETURN, TERMINATE, LAND = 2, 3, 4, 5
"""GF_ACTION; 0 does not look at all, 1 only warns."""
MODES = {HOLD: Mode.LOITER, RETURN: Mode.RTL, TERMINATE: Mode.TERMINATION, LAND: Mode.LAND}
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
        action: FailsafeAction,
        fence: Callable[[], Geofence],
        hold_at: Callable[[tuple[float, float], float], None],
        output: StatusOutput,
        names_limit: bool,
    ) -> None:
        self._state = state
        self._params = params
        self._clock = clock
        self._action = action
        self._fence = fence
        self._hold_at = hold_at
        self._text, self._event = output
        self._names_limit = names_limit
        self.boot()

    def boot(self) -> None:
        """Power-up."""
        self._state.status.fence_breached = False
        self._due_s = 0.0
        self._action.clear()

    def step(self) -> None:
        self._action.step()
        if self._clock.now_s >= self._due_s and self._state.status.position_valid:
            self._due_s = self._clock.now_s + CHECK_S
            self._check()

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
        return self._action.flown is Mode.LOITER and self._state.status.mode is Mode.LOITER

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
        body = self._state.body
        if action not in MODES:
            self._action.warn()
            return
        if action == HOLD:
            self._hold_at((body.north_m, body.east_m), body.up_m)
        self._action.begin(MODES[action])
