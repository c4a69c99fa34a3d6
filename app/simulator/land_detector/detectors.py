"""PX4's land detectors, one class for each vehicle type, and the table of them."""

from __future__ import annotations

import math

from app.simulator.airframe import Airframe
from app.simulator.clock import VehicleClock
from app.simulator.faults import VehicleFaults
from app.simulator.land_detector.base import LandDetector
from app.simulator.land_detector.sensing import LandSample, Sensing, TakeoffState
from app.simulator.params import Params
from app.simulator.state import Status, VehicleState
from app.simulator.wire import Mode

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
    """ground_contact, maybe_landed, landed: a third of LNDMC_TRIG_TIME each. All while disarmed; left at once."""

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
        """Low thrust and no movement though the vehicle is commanded to descend."""
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
    """Slow in every respect for LNDFW_TRIG_TIME; as in PX4 without ground contact, free fall and ground effect."""

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
        if blind and not sample.v_xy_valid:  # no speed at all: rotation has to decide
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


class VtolLandDetector(MulticopterLandDetector):
    """PX4's VtolLandDetector: as a multicopter; in fixed-wing flight by disarming alone, and never with airspeed."""

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


ROVER_LEAVES_S = 0.5
"""Armed it is "in the air" after this time [25_land_detector_rover]."""


class RoverLandDetector(LandDetector):
    """Always in contact; landed when disarmed, in Land or Descend mode, or in a return at its last point: a LAND item
    of a mission never completes. As a return begins where it stands, at a waypoint or in Hold, that is its last point
    for a moment.
    """

    def _set_times(self, factor: int) -> None:
        self._landed.fall_s = ROVER_LEAVES_S

    def _is_ground_contact(self, sample: LandSample) -> bool:
        return True

    def _is_landed(self, sample: LandSample) -> bool:
        if sample.mode in (Mode.LAND, Mode.DESCEND):
            return True
        is_there = sample.last_point_distance_m < float(self._params["NAV_ACC_RAD"])
        return (sample.mode is Mode.RTL and is_there) or not sample.armed


class AirshipLandDetector(LandDetector):
    """It floats: no contact, no free fall, and nothing but disarming shows that it has landed."""

    def _set_times(self, factor: int) -> None:
        self._landed.rise_s = self._landed.fall_s = 0.0

    def _is_landed(self, sample: LandSample) -> bool:
        return not sample.armed


DETECTORS: dict[str, type[LandDetector]] = {
    "plane": FixedWingLandDetector,
    "vtol": VtolLandDetector,
    "rover": RoverLandDetector,
    "airship": AirshipLandDetector,
}


def land_detector_for(
    airframe: Airframe, state: VehicleState, params: Params, clock: VehicleClock, faults: VehicleFaults
) -> LandDetector:
    """A fresh detector; what is none of the others is a multicopter."""
    detector = DETECTORS.get(airframe.name, MulticopterLandDetector)
    return detector(state.status, params, clock, Sensing(state, airframe, params, faults))
