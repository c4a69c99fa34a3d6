"""Loss of the ground station: NAV_DLL_ACT after COM_DL_LOSS_T without a GCS heartbeat [24_link_loss]."""

from __future__ import annotations

from collections.abc import Callable

from app.simulator.clock import VehicleClock
from app.simulator.commander import Commander
from app.simulator.params import Params
from app.simulator.state import Status
from app.simulator.wire import Mode, Severity

HEARTBEAT_TIMEOUT_S = 2.4
"""Until the link counts as silent; COM_DL_LOSS_T comes on top."""
ACTIONS = {1: Mode.LOITER, 2: Mode.RTL, 3: Mode.LAND}
TERMINATE, DISARM = 5, 6
"""The motors stop at once: these actions are neither delayed nor can anybody take over."""
LEFT_ALONE = frozenset({Mode.RTL, Mode.LAND})


class LinkLossFailsafe:
    """Hold for COM_FAIL_ACT_T, then the action. When the link comes back nothing is resumed."""

    def __init__(
        self,
        status: Status,
        params: Params,
        clock: VehicleClock,
        commander: Commander,
        text: Callable[[Severity, str], None],
        event: Callable[..., None],
    ) -> None:
        self._status = status
        self._params = params
        self._clock = clock
        self._commander = commander
        self._text = text
        self._event = event
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
        """One cycle."""
        if self._heard_at_s is not None and not self._status.gcs_lost:
            limit_s = float(self._params["COM_DL_LOSS_T"]) + HEARTBEAT_TIMEOUT_S * self._clock.speed
            if self._clock.now_s - self._heard_at_s > limit_s:
                self._lose()
        if self._act_at_s is not None and self._clock.now_s >= self._act_at_s:
            self._act_at_s = None
            action = ACTIONS.get(self._params.integer("NAV_DLL_ACT"))
            if action is not None and self._status.armed and self._status.mode is Mode.LOITER:
                self._text(Severity.CRITICAL, "Failsafe activated")
                self._commander.force_mode(action)

    def _lose(self) -> None:
        self._status.gcs_lost = True
        self._event("commander_gcs_lost")
        action = self._params.integer("NAV_DLL_ACT")
        if action in (TERMINATE, DISARM) and self._status.armed and self._status.mode is not Mode.LAND:
            self._text(Severity.CRITICAL, "Failsafe activated")
            if action == TERMINATE:
                self._commander.terminate()
            else:
                self._commander.disarm_by_failsafe()
            return
        acts = action in ACTIONS
        if not acts or not self._status.armed or self._status.landed or self._status.mode in LEFT_ALONE:
            return
        self._text(Severity.CRITICAL, "Failsafe activated")
        self._event("commander_failsafe_enter_hold", Mode.MISSION, 6, 5, 2)
        self._commander.force_mode(Mode.LOITER)
        self._act_at_s = self._clock.now_s + float(self._params["COM_FAIL_ACT_T"])
