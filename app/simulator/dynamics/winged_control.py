"""PX4's position and velocity loops of a hovering VTOL, whose thrust the wing can use up.

Nose down in fast hover flight the wing pushes down. The lift motors reach their limit, PX4 gives the height what it can
of the thrust, and what is left holds the tilt, and with it the speed, below what was asked for [27_vtol_transitions].
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from app.simulator.dynamics.hovering_wing import DRAG_PER_S, MASS_KG, air_force
from app.simulator.dynamics.model import Wind
from app.simulator.dynamics.position_control import (
    ANTI_WINDUP_GAIN,
    CLIMB_GAIN,
    CLIMB_INTEGRAL_GAIN,
    GRAVITY_M_S2,
    HEIGHT_GAIN,
    VELOCITY_DAMPING,
    VELOCITY_GAIN,
    VELOCITY_INTEGRAL_GAIN,
    Axis,
    or_zero,
    velocity_command,
)
from app.simulator.params import Params
from app.simulator.state import Body

ATTITUDE_LAG_S = 0.2  # 1 / MC_PITCH_P
TILT_MAX = 1.0  # tangent of MPC_TILTMAX_AIR
THRUST_M_S2 = 8.0 / MASS_KG  # four SIH_T_MAX
THRUST_SHARE = GRAVITY_M_S2 / THRUST_M_S2
"""What really hovers."""
PITCH_ARM_M = 0.2  # SIH_L_PITCH
HORIZONTAL_MARGIN = 0.3  # MPC_THR_XY_MARG
LEAST_THRUST = 0.12  # MPC_THR_MIN
HOVER_THRUST_RANGE = 0.2  # HTE_THR_RANGE
FASTER_DOWN = 1.2
"""MPC_Z_VEL_MAX_DN over MPC_Z_V_AUTO_DN."""

_Pair = tuple[float, float]


class WingedControl:
    """Follows the axes of a trajectory as PositionControl does."""

    def __init__(self, params: Params) -> None:
        self._params = params
        self._integral = [0.0, 0.0, 0.0]
        self._tilt = (0.0, 0.0)
        """Thrust to the north and to the east over thrust upwards."""
        self._gained = (0.0, 0.0)
        self._has_flown_on_the_wing = False

    def learn_hover_thrust(self) -> None:
        """PX4 takes over its estimate of the hover thrust in fixed-wing flight [12_vtol_delivery, 27]."""
        self._has_flown_on_the_wing = True

    def reset(self) -> None:
        """Level, the motors carry the weight."""
        self._integral = [0.0, 0.0, (THRUST_SHARE / self._hover_thrust() - 1.0) * GRAVITY_M_S2]
        self._tilt = self._gained = (0.0, 0.0)

    def step(self, body: Body, axes: Sequence[Axis], dt_s: float, wind: Wind, *, level: bool = False) -> None:
        """Advance speed, place and attitude by `dt_s`. `level`: without a position there is no horizontal control."""
        wanted, error = self._horizontal(body, axes, level)
        climb, climb_error = self._climb(body, axes[2])
        thrust, up = self._allocate(wanted, climb)
        self._integrate(wanted, error, climb_error, thrust, up, dt_s)
        share = min(dt_s / ATTITUDE_LAG_S, 1.0)
        self._tilt = (
            self._tilt[0] + share * (thrust[0] / up - self._tilt[0]),
            self._tilt[1] + share * (thrust[1] / up - self._tilt[1]),
        )
        self._move(body, math.hypot(*thrust, up) * THRUST_M_S2, dt_s, wind)

    def _hover_thrust(self) -> float:
        """What PX4 believes. Its estimate cannot leave HTE_THR_RANGE around MPC_THR_HOVER."""
        told = float(self._params["MPC_THR_HOVER"])
        if not self._has_flown_on_the_wing:
            return told
        return max(told - HOVER_THRUST_RANGE, min(told + HOVER_THRUST_RANGE, THRUST_SHARE))

    def _horizontal(self, body: Body, axes: Sequence[Axis], level: bool) -> tuple[_Pair, _Pair]:
        """Acceleration to the north and east, and the errors of the speed."""
        if level:
            self._integral[0] = self._integral[1] = 0.0
            return (0.0, 0.0), (0.0, 0.0)
        given = or_zero(axes[0].acceleration_m_s2), or_zero(axes[1].acceleration_m_s2)
        commands = velocity_command(body, axes, float(self._params["MPC_XY_VEL_MAX"]))
        if commands is None:  # only accelerations: PX4 resets the integrators
            self._integral[0] = self._integral[1] = 0.0
            return given, (0.0, 0.0)
        error = (commands[0] - body.v_north_m_s, commands[1] - body.v_east_m_s)
        north, east = (
            given[i] + VELOCITY_GAIN * error[i] + self._integral[i] - VELOCITY_DAMPING * self._gained[i] for i in (0, 1)
        )
        return (north, east), error

    def _climb(self, body: Body, axis: Axis) -> tuple[float, float]:
        params = self._params
        command = or_zero(axis.velocity_m_s) + or_zero(HEIGHT_GAIN * (axis.position_m - body.up_m))
        lowest = -FASTER_DOWN * float(params["MPC_Z_V_AUTO_DN"])
        body.climb_command_m_s = max(lowest, min(float(params["MPC_Z_V_AUTO_UP"]), command))
        error = body.climb_command_m_s - body.v_up_m_s
        return or_zero(axis.acceleration_m_s2) + CLIMB_GAIN * error + self._integral[2], error

    def _allocate(self, wanted: _Pair, climb: float) -> tuple[_Pair, float]:
        """Thrust to the north and east, and upwards, in shares of all there is: the height comes first."""
        hover = self._hover_thrust()
        tangent = math.hypot(*wanted) / GRAVITY_M_S2
        scale = min(1.0, TILT_MAX / tangent) if tangent > 0.0 else 1.0
        up = max(LEAST_THRUST, hover * (1.0 + climb / GRAVITY_M_S2))
        north, east = (wanted[i] / GRAVITY_M_S2 * scale * up for i in (0, 1))
        level = math.hypot(north, east)
        up = min(up, math.sqrt(1.0 - min(level, HORIZONTAL_MARGIN) ** 2))
        left = math.sqrt(max(0.0, 1.0 - up**2))
        fits = min(1.0, left / level) if level > 0.0 else 1.0
        return (north * fits, east * fits), up

    def _integrate(
        self, wanted: _Pair, error: _Pair, climb_error: float, thrust: _Pair, up: float, dt_s: float
    ) -> None:
        """With PX4's anti-windup: horizontally by what was not produced, vertically by standing still."""
        to_acceleration = GRAVITY_M_S2 / self._hover_thrust()
        short = math.hypot(*wanted) > math.hypot(*thrust) * to_acceleration
        for i in (0, 1):
            missing = wanted[i] - thrust[i] * to_acceleration if short else 0.0
            self._integral[i] += VELOCITY_INTEGRAL_GAIN * (error[i] - ANTI_WINDUP_GAIN * missing) * dt_s
        if (up <= LEAST_THRUST and climb_error < 0.0) or (up >= 1.0 and climb_error > 0.0):
            return
        integral = self._integral[2] + CLIMB_INTEGRAL_GAIN * climb_error * dt_s
        self._integral[2] = max(-GRAVITY_M_S2, min(GRAVITY_M_S2, integral))

    def _move(self, body: Body, thrust_m_s2: float, dt_s: float, wind: Wind) -> None:
        cos, sin = math.cos(body.yaw_rad), math.sin(body.yaw_rad)
        ahead, aside = self._tilt[0] * cos + self._tilt[1] * sin, -self._tilt[0] * sin + self._tilt[1] * cos
        air = (body.v_north_m_s - wind.north_m_s, body.v_east_m_s - wind.east_m_s)
        air_ahead, air_aside = air[0] * cos + air[1] * sin, -air[0] * sin + air[1] * cos
        pitch = -math.atan(ahead)
        nose, drop = math.cos(pitch), math.sin(pitch)
        force = air_force(air_ahead * nose + body.v_up_m_s * drop, air_ahead * drop - body.v_up_m_s * nose)
        weakest = THRUST_M_S2 - force.nose_up_nm / PITCH_ARM_M / MASS_KG
        lift = min(thrust_m_s2, weakest) - force.downward_m_s2
        upright = lift / math.hypot(1.0, ahead, aside)
        gained_ahead = upright * ahead - force.backward_m_s2 * nose
        gained_aside = upright * aside - DRAG_PER_S * air_aside
        self._gained = (gained_ahead * cos - gained_aside * sin, gained_ahead * sin + gained_aside * cos)
        body.v_north_m_s += self._gained[0] * dt_s
        body.v_east_m_s += self._gained[1] * dt_s
        body.v_up_m_s += (upright - GRAVITY_M_S2 - force.backward_m_s2 * drop) * dt_s
        body.north_m += body.v_north_m_s * dt_s
        body.east_m += body.v_east_m_s * dt_s
        body.up_m = max(0.0, body.up_m + body.v_up_m_s * dt_s)
        body.pitch_rad, body.roll_rad = pitch, math.atan(aside)
