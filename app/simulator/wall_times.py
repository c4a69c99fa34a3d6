"""Parameters that are wall time in a simulation: the vehicle reads them in its own time, which runs faster."""

from __future__ import annotations

from typing import Final

from app.simulator.clock import VehicleClock
from app.simulator.options import MAX_LIVE_SPEED
from app.simulator.params import Params

SCALED_BY_SPEED: Final = ("COM_DL_LOSS_T", "COM_OF_LOSS_T")
"""PX4's SITL start-up multiplies these by the speed factor, so that they stay wall time."""
START_TIME: Final = "COM_DISARM_PRFLT"
"""PX4 does not: the time from arming to the take-off order. Above 4x it would be over before the order can come."""


class WallTimes:
    """Multiplies them by the clock's speed, now and at every change of it. One that a ground station has set counts
    from then on.
    """

    def __init__(self, params: Params, clock: VehicleClock) -> None:
        self._params = params
        self._clock = clock
        self._real = {name: float(params[name]) for name in (*SCALED_BY_SPEED, START_TIME)}
        self._last = {name: params[name] for name in self._real}
        self._factors = dict.fromkeys(self._real, 1.0)
        self._scale()
        clock.on_speed(lambda factor: self._scale())

    def _scale(self) -> None:
        for name in self._real:
            if self._params[name] != self._last[name]:
                self._real[name] = float(self._params[name]) / self._factors[name]
            self._factors[name] = _factor(name, self._clock.speed)
            self._params.set(name, self._real[name] * self._factors[name])
            self._last[name] = self._params[name]


def _factor(name: str, speed: float) -> float:
    return max(1.0, speed / MAX_LIVE_SPEED) if name == START_TIME else speed
