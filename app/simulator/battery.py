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
RETURN_AT_CRITICAL = 3
LAND_AT_EMERGENCY = (2, 3)


class Battery:
    """Each level is announced once, until the battery is changed."""

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

    def set_fraction(self, fraction: float) -> None:
        """Somebody changed the battery, or a fault did."""
        self._status.battery_fraction = max(0.0, min(1.0, fraction))
        if self._level() == 0:
            self._announced = 0

    def step(self) -> None:
        """One cycle."""
        status = self._status
        if status.armed:
            status.battery_fraction = max(0.0, status.battery_fraction - VehicleClock.STEP_S / ENDURANCE_S)
        level = self._level()
        if level > self._announced and status.armed:
            self._announced = level
            self._announce(level)

    def _level(self) -> int:
        fraction, params = self._status.battery_fraction, self._params
        low, critical = fraction <= params["BAT_LOW_THR"], fraction <= params["BAT_CRIT_THR"]
        return low + critical + (fraction <= params["BAT_EMERGEN_THR"])

    def _announce(self, level: int) -> None:
        name = ("", "Low", "Critical", "Emergency")[level]
        self._text(Severity.WARNING if level == 1 else Severity.CRITICAL, f"{name} battery level")
        action = self._params.integer("COM_LOW_BAT_ACT")
        if self._status.landed:
            return
        if level == 2 and action == RETURN_AT_CRITICAL:
            self._commander.force_mode(Mode.RTL)
        elif level == 3 and action in LAND_AT_EMERGENCY:
            self._commander.force_mode(Mode.LAND)
