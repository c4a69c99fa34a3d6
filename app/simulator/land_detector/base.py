"""The common base of PX4's land detectors: hysteresis of each state, publishing, total flight time."""

from __future__ import annotations

from abc import ABC, abstractmethod

from app.simulator.clock import VehicleClock
from app.simulator.land_detector.at_rest import AtRest
from app.simulator.land_detector.flight_time import FlightTime
from app.simulator.land_detector.hysteresis import Hysteresis
from app.simulator.land_detector.landed_state import landed_state
from app.simulator.land_detector.sample import LandSample
from app.simulator.land_detector.sensing import Sensing
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint
from app.simulator.state import LandDetected, Status
from app.simulator.wire import LandedState

PUBLISH_S = 1.0
"""At least this often, and at once when a state changes."""
WITHOUT_RANGE_FACTOR = 3
"""A vehicle with a range sensor that gives no valid data waits this many times longer."""


class LandDetector(ABC):
    """Writes `status.land` and `status.landed_state`. A type answers for each state whether its conditions hold."""

    def __init__(self, status: Status, params: Params, clock: VehicleClock, sensing: Sensing) -> None:
        self._status = status
        self._params = params
        self._clock = clock
        self._sensing = sensing
        self._flight_time = FlightTime(params)
        self._was_armed = False
        self._was_landed = True
        self._times: tuple[int, int] | None = None
        """Factor, and the parameters' version, that the hysteresis times are set for."""
        self._restart()

    def boot(self) -> None:
        """Power-up: on the ground until the contrary is seen."""
        self._restart()
        self._sensing.restart()
        self._flight_time.restart()
        self._status.land = LandDetected()
        self._status.landed_state = LandedState.ON_GROUND

    def step(self, setpoint: Setpoint) -> None:
        """One cycle."""
        self.take(self._sensing.sample())
        status = self._status
        status.landed_state = landed_state(status.land.landed, status.mode, setpoint.kind)

    def take(self, sample: LandSample) -> None:
        """One cycle with given readings, in PX4's order: each state may build on those above it."""
        now_s = self._clock.now_s
        blind = sample.has_range_sensor and sample.dist_bottom_m is None
        times = (WITHOUT_RANGE_FACTOR if blind else 1, self._params.version)
        if times != self._times:
            self._times = times
            self._set_times(times[0])
        self._freefall.update(self._is_freefall(sample), now_s)
        self._ground_contact.update(self._is_ground_contact(sample), now_s)
        self._maybe_landed.update(self._is_maybe_landed(sample), now_s)
        self._landed.update(self._is_landed(sample), now_s)
        self._ground_effect.update(self._is_in_ground_effect(sample), now_s)
        at_rest = self._at_rest.update(sample, now_s) and self._landed.state
        self._publish(at_rest, now_s)
        if self._was_armed and not sample.armed:
            self._flight_time.disarm(now_s)
        self._was_armed = sample.armed

    # what a type decides ------------------------------------------------------------------------------------

    @abstractmethod
    def _is_landed(self, sample: LandSample) -> bool:
        """Whether the conditions of `landed` hold now."""

    @abstractmethod
    def _set_times(self, factor: int) -> None:
        """Set the hysteresis times; `factor` is larger without valid range data. Only multicopters heed it."""

    def _is_freefall(self, sample: LandSample) -> bool:
        return False

    def _is_ground_contact(self, sample: LandSample) -> bool:
        return False

    def _is_maybe_landed(self, sample: LandSample) -> bool:
        return False

    def _is_in_ground_effect(self, sample: LandSample) -> bool:
        return False

    # publishing ---------------------------------------------------------------------------------------------

    def _restart(self) -> None:
        self._times = None
        self._freefall = Hysteresis()
        self._ground_contact = Hysteresis(True)
        self._maybe_landed = Hysteresis(True)
        self._landed = Hysteresis(True)
        self._ground_effect = Hysteresis()
        self._at_rest = AtRest(self._clock.now_s)
        self._was_armed = False
        self._was_landed = True

    def _publish(self, at_rest: bool, now_s: float) -> None:
        landed = self._landed.state
        if self._was_landed and not landed:
            self._flight_time.take_off(now_s)
        self._was_landed = landed
        states = (
            self._freefall.state,
            self._ground_contact.state,
            self._maybe_landed.state,
            landed,
            self._ground_effect.state,
            at_rest,
        )
        land = self._status.land
        if states != land.states or now_s - land.published_at_s >= PUBLISH_S:
            self._status.land = LandDetected(*states, published_at_s=now_s)
