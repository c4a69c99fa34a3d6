"""VTOLs: as multicopters; in fixed-wing flight they land by disarming alone, and never with airspeed."""

from __future__ import annotations

from app.simulator.clock import VehicleClock
from app.simulator.land_detector.fixed_wing import KEEP_AIRSPEED, RUNS_PER_CYCLE, low_pass
from app.simulator.land_detector.multicopter import MulticopterLandDetector
from app.simulator.land_detector.sample import LandSample
from app.simulator.land_detector.sensing import Sensing
from app.simulator.params import Params
from app.simulator.state import Status


class VtolLandDetector(MulticopterLandDetector):
    """Hovering and in transition the multicopter's rules hold. PX4 VtolLandDetector."""

    def __init__(self, status: Status, params: Params, clock: VehicleClock, sensing: Sensing) -> None:
        super().__init__(status, params, clock, sensing)
        self._airspeed_m_s = 0.0
        self._was_in_air = False

    def boot(self) -> None:
        super().boot()
        self._airspeed_m_s = 0.0
        self._was_in_air = False

    def _is_freefall(self, sample: LandSample) -> bool:
        return not sample.fixed_wing and super()._is_freefall(sample)

    def _is_maybe_landed(self, sample: LandSample) -> bool:
        return not sample.armed if sample.fixed_wing else super()._is_maybe_landed(sample)

    def _is_landed(self, sample: LandSample) -> bool:
        """Airspeed counts only once it has flown: on the ground it may be wind."""
        if sample.fixed_wing:
            return not sample.armed
        if sample.airspeed_m_s is None:
            self._airspeed_m_s = 0.0
        else:
            for _ in range(RUNS_PER_CYCLE):
                self._airspeed_m_s = low_pass(self._airspeed_m_s, sample.airspeed_m_s, KEEP_AIRSPEED)
        landed = super()._is_landed(sample)
        if self._was_in_air and self._airspeed_m_s > float(self._params["LNDFW_AIRSPD_MAX"]):
            landed = False
        self._was_in_air = not landed
        return landed
