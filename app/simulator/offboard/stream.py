"""The newest setpoint, and whether its sender still lives."""

from __future__ import annotations

from app.simulator.clock import VehicleClock
from app.simulator.offboard.target import OffboardTarget
from app.simulator.params import Params


class OffboardStream:
    """Proof of life: the newest valid setpoint is younger than COM_OF_LOSS_T, whatever the rate."""

    def __init__(self, params: Params, clock: VehicleClock) -> None:
        self._params = params
        self._clock = clock
        self._heard_at_s: float | None = None
        self.newest: OffboardTarget | None = None

    def boot(self) -> None:
        """Power-up: nothing was heard."""
        self._heard_at_s = None
        self.newest = None

    def hear(self, target: OffboardTarget) -> None:
        """A setpoint that was accepted."""
        self.newest = target
        self._heard_at_s = self._clock.now_s

    @property
    def lives(self) -> bool:
        """Whether OFFBOARD can be flown now."""
        if self._heard_at_s is None:
            return False
        return self._clock.now_s - self._heard_at_s <= float(self._params["COM_OF_LOSS_T"])
