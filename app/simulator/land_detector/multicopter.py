"""Multicopters: ground_contact, then maybe_landed, then landed, each for a third of LNDMC_TRIG_TIME."""

from __future__ import annotations

import math

from app.simulator.clock import VehicleClock
from app.simulator.land_detector.base import LandDetector
from app.simulator.land_detector.sample import LandSample, TakeoffState
from app.simulator.land_detector.sensing import Sensing
from app.simulator.params import Params
from app.simulator.state import Status

FREEFALL_M_S2 = 2.0
FREEFALL_S = 0.3
CLOSE_TO_GROUND_M = 1.0
DESCENT_M_S = 0.2
"""A commanded descent; a landing crawls down at 0.3 m/s."""
LOW_SHARE, LOW_SHARE_ESTIMATED, MIN_SHARE = 0.3, 0.6, 0.1
"""Of the throttle range from minimum to hover: low thrust (without, with a hover thrust estimate), minimum thrust."""
WIDER = 2.5
"""Limits of movement and rotation are this much wider once the vehicle may have landed."""


class MulticopterLandDetector(LandDetector):
    """Disarmed all three hold. Leaving any of them is immediate."""

    def __init__(self, status: Status, params: Params, clock: VehicleClock, sensing: Sensing) -> None:
        super().__init__(status, params, clock, sensing)
        self._hover_throttle = float(params["MPC_THR_HOVER"])

    def boot(self) -> None:
        super().boot()
        self._hover_throttle = float(self._params["MPC_THR_HOVER"])

    def _set_times(self, factor: int) -> None:
        third_s = float(self._params["LNDMC_TRIG_TIME"]) / 3.0 * factor
        for state in (self._ground_contact, self._maybe_landed, self._landed):
            state.rise_s = third_s
        self._freefall.rise_s = FREEFALL_S

    def _is_freefall(self, sample: LandSample) -> bool:
        return sample.specific_force_m_s2 < FREEFALL_M_S2

    def _is_ground_contact(self, sample: LandSample) -> bool:
        """Low thrust and no movement though the vehicle is told to go down."""
        if sample.hover_throttle is not None:
            self._hover_throttle = sample.hover_throttle
        if not sample.armed:
            return True
        pushes_down = self._in_descend(sample) or self._maybe_landed.state or self._landed.state
        if not pushes_down and sample.climb_rate_controlled:
            return False
        moves = self._moves_vertically(sample) or self._moves_horizontally(sample)
        near = sample.dist_bottom_m is None or sample.dist_bottom_m < CLOSE_TO_GROUND_M
        return self._has_low_throttle(sample) and not moves and near

    def _is_maybe_landed(self, sample: LandSample) -> bool:
        """Ground contact, minimum thrust, no rotation and no free fall."""
        if not sample.armed:
            return True
        limit_rad_s = math.radians(float(self._params["LNDMC_ROT_MAX"])) * self._widening
        still = sample.rate_xy_rad_s <= limit_rad_s and not self._freefall.state
        return self._ground_contact.state and self._has_min_throttle(sample) and still

    def _is_landed(self, sample: LandSample) -> bool:
        return not sample.armed or self._maybe_landed.state

    def _is_in_ground_effect(self, sample: LandSample) -> bool:
        limit_m = float(self._params["LNDMC_ALT_GND"])
        below = sample.dist_bottom_m is not None and sample.dist_bottom_m < limit_m
        flies_low = below and sample.takeoff_state is TakeoffState.FLIGHT
        descends = self._in_descend(sample) and not self._moves_horizontally(sample)
        return descends or flies_low or sample.takeoff_state is TakeoffState.RAMPUP

    # conditions ---------------------------------------------------------------------------------------------

    @property
    def _widening(self) -> float:
        return WIDER if self._maybe_landed.state else 1.0

    def _in_descend(self, sample: LandSample) -> bool:
        return sample.climb_rate_controlled and sample.climb_command_m_s < -DESCENT_M_S

    def _moves_vertically(self, sample: LandSample) -> bool:
        return sample.v_z_m_s > float(self._params["LNDMC_Z_VEL_MAX"]) * self._widening

    def _moves_horizontally(self, sample: LandSample) -> bool:
        """Without a horizontal speed: not known, so no."""
        return sample.v_xy_valid and sample.v_xy_m_s > float(self._params["LNDMC_XY_VEL_MAX"])

    def _throttle_at(self, share: float) -> float:
        lowest = float(self._params["MPC_THR_MIN"])
        return lowest + (self._hover_throttle - lowest) * share

    def _has_low_throttle(self, sample: LandSample) -> bool:
        share = LOW_SHARE if sample.hover_throttle is None else LOW_SHARE_ESTIMATED
        return sample.throttle <= self._throttle_at(share)

    def _has_min_throttle(self, sample: LandSample) -> bool:
        if sample.climb_rate_controlled:
            return sample.throttle <= self._throttle_at(MIN_SHARE)
        return sample.throttle <= float(self._params["MPC_MANTHR_MIN"]) + 0.01
