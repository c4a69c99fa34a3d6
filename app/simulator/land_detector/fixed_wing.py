"""Fixed wings: slow in every respect for LNDFW_TRIG_TIME."""

from __future__ import annotations

import math

from app.simulator.clock import VehicleClock
from app.simulator.land_detector.base import LandDetector
from app.simulator.land_detector.sample import LandSample
from app.simulator.land_detector.sensing import Sensing
from app.simulator.params import Params
from app.simulator.state import Status

RUNS_PER_CYCLE = 2
"""PX4 filters once per position estimate, at 100 Hz; a cycle here is 20 ms."""
LEAVES_S = 0.5
"""Until "landed" is given up on the runway [25_land_detector_plane]."""
KEEP_AIRSPEED, KEEP_XY, KEEP_Z, KEEP_ROTATION = 0.95, 0.97, 0.99, 0.95
KEEP_ACCELERATION, NEW_ACCELERATION = 0.8, 0.18
"""A leaking low pass: no bias builds up."""
WITHOUT_AIRSPEED = 0.7
"""The limit of ground speed is tighter without an airspeed sensor."""


class FixedWingLandDetector(LandDetector):
    """Only `landed` and `at_rest`: as in PX4 there is no ground contact, free fall or ground effect."""

    def __init__(self, status: Status, params: Params, clock: VehicleClock, sensing: Sensing) -> None:
        super().__init__(status, params, clock, sensing)
        self._forget()

    def boot(self) -> None:
        super().boot()
        self._forget()

    def _forget(self) -> None:
        self._airspeed_m_s = self._v_xy_m_s = self._v_z_m_s = 0.0
        self._acceleration_m_s2 = self._rate_rad_s = 0.0

    def _set_times(self, factor: int) -> None:
        self._landed.rise_s = float(self._params["LNDFW_TRIG_TIME"])
        self._landed.fall_s = LEAVES_S

    def _is_landed(self, sample: LandSample) -> bool:
        if not sample.armed:
            return True
        for _ in range(RUNS_PER_CYCLE):
            self._filter(sample)
        params, blind = self._params, sample.airspeed_m_s is None
        fastest_m_s = float(params["LNDFW_VEL_XY_MAX"]) * (WITHOUT_AIRSPEED if blind else 1.0)
        turns = False
        if blind and not sample.v_xy_valid:  # no speed at all: rotation has to tell
            turns = self._rate_rad_s >= math.radians(float(params["LNDFW_ROT_MAX"]))
        return (
            self._airspeed_m_s < float(params["LNDFW_AIRSPD_MAX"])
            and self._v_xy_m_s < fastest_m_s
            and self._v_z_m_s < float(params["LNDFW_VEL_Z_MAX"])
            and self._acceleration_m_s2 < float(params["LNDFW_XYACC_MAX"])
            and not turns
        )

    def _filter(self, sample: LandSample) -> None:
        v_xy_m_s = sample.v_xy_m_s if sample.v_xy_valid else None
        self._v_xy_m_s = 0.0 if v_xy_m_s is None else low_pass(self._v_xy_m_s, v_xy_m_s, KEEP_XY)
        self._v_z_m_s = low_pass(self._v_z_m_s, sample.v_z_m_s, KEEP_Z)
        airspeed_m_s = sample.airspeed_m_s
        self._airspeed_m_s = 0.0 if airspeed_m_s is None else low_pass(self._airspeed_m_s, airspeed_m_s, KEEP_AIRSPEED)
        self._acceleration_m_s2 *= KEEP_ACCELERATION
        self._acceleration_m_s2 += NEW_ACCELERATION * sample.acceleration_xy_m_s2
        self._rate_rad_s = low_pass(self._rate_rad_s, sample.rate_rad_s, KEEP_ROTATION)


def low_pass(old: float, new: float, keep: float) -> float:
    """One run of a first-order filter that keeps this share of the old value."""
    return keep * old + (1.0 - keep) * new
