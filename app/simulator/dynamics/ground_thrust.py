"""The thrust of a multicopter that stands on the ground: the ramp before a takeoff, the fall after a touch-down."""

from __future__ import annotations

import math

from app.simulator.params import Params
from app.simulator.state import Status

GRAVITY_M_S2 = 9.81
HEIGHT_GAIN = 1.0  # MPC_Z_P
CLIMB_GAIN = 4.0  # MPC_Z_VEL_P_ACC
CLIMB_INTEGRAL_GAIN = 2.0  # MPC_Z_VEL_I_ACC
WANTED_AFTER_S = 0.4
"""A way that begins at rest asks for 0.3 m/s upwards after this (FlightTask::_checkTakeoff, MPC_JERK_AUTO)."""


class GroundThrust:
    """Modelled: PX4's height and climb rate loops winding up against the ground [25_land_detector_quad, within 0.02].

    The land detector's verdicts feed back: ground contact leaves minimum thrust, maybe landed none.
    """

    def __init__(self, params: Params, status: Status, hover_throttle: float) -> None:
        self._params = params
        self._status = status
        self._hover_throttle = hover_throttle
        self._armed_s = 0.0
        self._pushing_s = 0.0

    def restart(self) -> None:
        """Disarmed, or taken off."""
        self._armed_s = self._pushing_s = 0.0

    def touch_down(self) -> None:
        """The ground stops the descent; the motors have been running for long."""
        self._armed_s = float(self._params["COM_SPOOLUP_TIME"])
        self._pushing_s = 0.0

    @property
    def climb_ramp_m_s2(self) -> float:
        """How fast the climb that the controller allows rises (TakeoffHandling::updateRamp), from all the way down."""
        most_m_s = 1.2 * float(self._params["MPC_Z_V_AUTO_UP"])
        return (GRAVITY_M_S2 / CLIMB_GAIN + most_m_s) / max(float(self._params["MPC_TKO_RAMP_T"]), 1e-3)

    @property
    def lifts_after_s(self) -> float:
        """From a target in the air, that is no takeoff, to hover thrust: the ramp has to undo its own integrator."""
        ramp, down_m_s = self.climb_ramp_m_s2, GRAVITY_M_S2 / CLIMB_GAIN
        square, linear = CLIMB_INTEGRAL_GAIN * ramp / 2.0, CLIMB_GAIN * ramp - CLIMB_INTEGRAL_GAIN * down_m_s
        root = math.sqrt(linear**2 + 4.0 * square * CLIMB_GAIN * down_m_s)
        return WANTED_AFTER_S + (root - linear) / (2.0 * square)

    def step(self, throttle: float, climb_command_m_s: float, dt_s: float, *, takes_off: bool = True) -> float:
        """The next throttle, 0..1. `takes_off`: a takeoff is what is asked for, and no other place in the air."""
        self._armed_s += dt_s
        if climb_command_m_s > 0.0:
            self._pushing_s = 0.0
            ramp_s = float(self._params["MPC_TKO_RAMP_T"]) if takes_off else self.lifts_after_s
            return self._ramp(throttle, max(ramp_s, dt_s), dt_s)
        if self._status.land.maybe_landed:
            self._pushing_s = 0.0
            return 0.0
        self._pushing_s += dt_s
        lowest = float(self._params["MPC_THR_MIN"])
        if self._status.land.ground_contact:
            return lowest
        return min(throttle, max(lowest, self._wound_up(-climb_command_m_s)))

    def _ramp(self, throttle: float, ramp_s: float, dt_s: float) -> float:
        """Up to the hover thrust that the parameters say, once the motors have spooled up."""
        if self._armed_s < float(self._params["COM_SPOOLUP_TIME"]):
            return 0.0
        slope_per_s = float(self._params["MPC_THR_HOVER"]) / ramp_s
        return min(1.0, throttle + slope_per_s * dt_s)

    def _wound_up(self, descent_m_s: float) -> float:
        """The commanded point sinks on below the ground: its distance and the integrator both grow."""
        time_s = self._pushing_s
        missing_m_s = descent_m_s * (1.0 + HEIGHT_GAIN * time_s)
        integral_m = descent_m_s * (time_s + HEIGHT_GAIN * time_s**2 / 2.0)
        acceleration = CLIMB_GAIN * missing_m_s + CLIMB_INTEGRAL_GAIN * integral_m
        return self._hover_throttle * (1.0 - acceleration / GRAVITY_M_S2)
