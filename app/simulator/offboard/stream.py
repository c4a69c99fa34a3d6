"""The newest setpoint, and whether its sender still lives."""

from __future__ import annotations

from app.simulator.clock import VehicleClock
from app.simulator.offboard.target import OffboardTarget
from app.simulator.options import MAX_LIVE_SPEED
from app.simulator.params import Params


class OffboardStream:
    """Proof of life: the newest valid setpoint is younger than COM_OF_LOSS_T, whatever the rate.

    Above MAX_LIVE_SPEED no stream lives: its sender's timers are wall clock.
    """

    def __init__(self, params: Params, clock: VehicleClock) -> None:
        self._params = params
        self._clock = clock
        self._heard_at_s: float | None = None
        self.newest: OffboardTarget | None = None
        clock.on_speed(self._change_speed)

    def boot(self) -> None:
        """Power-up: nothing was heard."""
        self._heard_at_s = None
        self.newest = None

    def hear(self, target: OffboardTarget) -> None:
        """A setpoint that was accepted."""
        self.newest = target
        self._heard_at_s = self._clock.now_s

    def _change_speed(self, factor: float) -> None:
        if self._heard_at_s is not None:
            self._heard_at_s = self._clock.same_by_the_wall(self._heard_at_s, factor)

    @property
    def too_fast(self) -> bool:
        """Simulated time runs too fast for anybody to control the vehicle."""
        return self._clock.speed > MAX_LIVE_SPEED

    @property
    def flies_blind(self) -> bool:
        """Attitude or rates: no position is needed to follow the newest setpoint."""
        return self.newest is not None and self.newest.is_attitude

    @property
    def lives(self) -> bool:
        """Whether OFFBOARD can be flown now."""
        if self.too_fast or self._heard_at_s is None:
            return False
        return self._clock.now_s - self._heard_at_s <= float(self._params["COM_OF_LOSS_T"])
