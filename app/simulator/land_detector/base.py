"""The common base of PX4's land detectors: hysteresis of each state, publishing, total flight time."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

from app.simulator.clock import VehicleClock
from app.simulator.land_detector.sensing import LandSample, Sensing
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint, SetpointKind
from app.simulator.state import LandDetected, Status
from app.simulator.wire import LandedState, Mode

TOLERANCE_S = 1e-9
"""Vehicle time is a multiple of 20 ms in binary fractions."""


class Hysteresis:
    """PX4's systemlib::Hysteresis. `rise_s` is the wait from False to True, `fall_s` from True to False."""

    def __init__(self, state: bool = False) -> None:
        self.state = state
        self.rise_s = 0.0
        self.fall_s = 0.0
        self._requested = state
        self._since_s = 0.0

    def update(self, wanted: bool, now_s: float) -> bool:
        """Give the input at this time; returns the state."""
        if wanted != self._requested:
            self._requested = wanted
            self._since_s = now_s
        if self._requested != self.state:
            wait_s = self.rise_s if self._requested else self.fall_s
            if now_s - self._since_s >= wait_s - TOLERANCE_S:
                self.state = self._requested
        return self.state


GYRO_MAX_RAD_S = math.radians(3.0)
ROLLING_M_S = 0.1
STILL_S = 1.0


class AtRest:
    """True a second after the last movement. Modelled: turning motors and rolling wheels shake the frame."""

    def __init__(self, now_s: float) -> None:
        self._moved_at_s = now_s

    def update(self, sample: LandSample, now_s: float) -> bool:
        """One cycle; whether the vehicle is at rest (the base adds that it has to be landed)."""
        shakes = sample.throttle > 0.0 or sample.v_xy_m_s > ROLLING_M_S
        if shakes or sample.rate_rad_s > GYRO_MAX_RAD_S:
            self._moved_at_s = now_s
        return now_s - self._moved_at_s > STILL_S


HIGH, LOW = "LND_FLIGHT_T_HI", "LND_FLIGHT_T_LO"
"""Together 64 bits of microseconds."""
WORD = 1 << 32
SIGN = 1 << 31


class FlightTime:
    """Counts from the first take-off after arming until disarming; stored then, so a reboot in the air loses it."""

    def __init__(self, params: Params) -> None:
        self._params = params
        self._took_off_s: float | None = None

    def restart(self) -> None:
        """Power-up."""
        self._took_off_s = None

    def take_off(self, now_s: float) -> None:
        """The vehicle left the ground; counts once until disarming."""
        if self._took_off_s is None:
            self._took_off_s = now_s

    def disarm(self, now_s: float) -> None:
        if self._took_off_s is None:
            return
        total_us = self.total_us + round((now_s - self._took_off_s) * 1e6)
        self._took_off_s = None
        self._params.set(HIGH, total_us // WORD)
        low = total_us % WORD
        self._params.set(LOW, low - WORD if low >= SIGN else low)  # PX4 stores the bits in an int32

    @property
    def total_us(self) -> int:
        return self._params.integer(HIGH) * WORD + self._params.integer(LOW) % WORD


def landed_state(landed: bool, mode: Mode, kind: SetpointKind) -> LandedState:
    """PX4's MavlinkStreamExtendedSysState: TAKEOFF and LANDING are the setpoint's type, in the auto modes only."""
    if landed:
        return LandedState.ON_GROUND
    if kind is SetpointKind.TAKEOFF and mode.is_auto:
        return LandedState.TAKEOFF
    if kind is SetpointKind.LAND and mode.is_auto:
        return LandedState.LANDING
    return LandedState.IN_AIR


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
        self.take(self._sensing.sample(setpoint))
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
