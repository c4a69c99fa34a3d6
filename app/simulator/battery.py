"""The battery: drains while armed, warns, and acts by COM_LOW_BAT_ACT."""

from __future__ import annotations

from collections.abc import Callable

from app.simulator.clock import VehicleClock
from app.simulator.commander import Commander
from app.simulator.params import Params
from app.simulator.state import Status
from app.simulator.wire import Mode, Severity

ENDURANCE_S = 1500.0
"""Flying time from full to empty."""
CRITICAL, EMERGENCY = 2, 3
ACTIONS = {
    1: {CRITICAL: Mode.RTL, EMERGENCY: Mode.RTL},
    2: {CRITICAL: Mode.LAND, EMERGENCY: Mode.LAND},
    3: {CRITICAL: Mode.RTL, EMERGENCY: Mode.LAND},
}
"""COM_LOW_BAT_ACT to level to what is flown; else it is only said."""


class Battery:
    """Each level is announced once, until the battery is changed, and acts once, when the vehicle flies.

    As in PX4 a level that was there when the vehicle was armed (by force) is only said.
    """

    def __init__(
        self,
        status: Status,
        params: Params,
        commander: Commander,
        text: Callable[[Severity, str], None],
    ) -> None:
        self._status = status
        self._params = params
        self._commander = commander
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
        """One cycle."""
        status = self._status
        if status.armed:
            status.battery_fraction = max(0.0, status.battery_fraction - VehicleClock.STEP_S / ENDURANCE_S)
        level = self._level()
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
        mode = ACTIONS.get(self._params.integer("COM_LOW_BAT_ACT"), {}).get(level)
        if mode is not None:
            self._commander.force_mode(mode)
