"""What the air does to a hovering VTOL: flat plates at any angle of attack (PX4's SIH standard VTOL, aero.hpp)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

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

AIR_KG_M3 = 1.17
"""At 490 m above the sea."""
MASS_KG = 0.2
DRAG_PER_S = 1.0  # SIH_KDV over the mass
STALL_RAD = math.radians(20.0)
BLEND_RAD = math.radians(10.0)
PLATE_DRAG = 0.04
NORMAL_DRAG = 1.98
FINS_M2 = 0.2 * 0.8 + 0.25 * 0.18
"""Fuselage and fin: upright plates, which only have their drag along the flow."""
PUSHER_M = 8 * 0.0254
PUSHER_REV_S = 9000 / 60.0


@dataclass(frozen=True, slots=True)
class AirForce:
    """Accelerations along the body's axes in m/s2, and what the lift motors lose of their thrust to its moment."""

    backward_m_s2: float
    downward_m_s2: float
    nose_up_nm: float


@dataclass(frozen=True, slots=True)
class _Plate:
    span_m: float
    chord_m: float
    zero_lift_rad: float
    arm_m: float
    """Behind the centre of mass."""

    def force(self, attack_rad: float, speed_m_s: float) -> tuple[float, float, float]:
        """Forward and upward in newton, nose up in newton metres."""
        angle = attack_rad - self.zero_lift_rad
        lift, drag, moment = self._coefficients(angle)
        newton = 0.5 * AIR_KG_M3 * speed_m_s**2 * self.span_m * self.chord_m
        forward = newton * (lift * math.sin(angle) - drag * math.cos(angle))
        upward = newton * (lift * math.cos(angle) + drag * math.sin(angle))
        return forward, upward, newton * self.chord_m * moment - self.arm_m * upward

    def _coefficients(self, angle: float) -> tuple[float, float, float]:
        """Of lift, drag and moment: attached flow up to the stall, a plate across the flow beyond."""
        ratio = self.span_m / self.chord_m
        slope = 2.0 * math.pi / (1.0 + 2.0 * (ratio + 4.0) / (ratio * (ratio + 2.0)))
        sin, cos = math.sin(angle), math.cos(angle)
        edge = 1.0 / (0.56 + 0.44 * abs(sin)) - 0.41 * (1.0 - math.exp(-17.0 / ratio))
        normal, along = NORMAL_DRAG * sin * edge, 0.5 * PLATE_DRAG * cos
        stalled = normal * cos - along * sin, normal * sin + along * cos
        moment = -normal * (0.25 - 7.0 / 40.0 * (1.0 - 2.0 / math.pi * abs(angle)))
        lift = slope * sin * cos * cos + math.pi * abs(sin) * sin * cos
        drag = PLATE_DRAG + abs(stalled[0] * math.tan(angle)) if abs(cos) > 0.1 else stalled[1]
        limit = STALL_RAD - math.copysign(1.0, angle) * self.zero_lift_rad
        attached = 0.5 * (1.0 - math.tanh(4.0 * (abs(angle) - limit) / BLEND_RAD))
        return (
            attached * lift + (1.0 - attached) * stalled[0],
            attached * drag + (1.0 - attached) * stalled[1],
            -attached * 0.17 * math.pi * abs(sin) * sin + (1.0 - attached) * moment,
        )


_PLATES = (_Plate(0.86, 0.21, math.radians(-4.0), 0.0), _Plate(0.3, 0.1, 0.0, 0.4))


def air_force(forward_m_s: float, down_m_s: float) -> AirForce:
    """Of the air that a body with these speeds along its own axes meets."""
    speed = math.hypot(forward_m_s, down_m_s)
    if speed < 0.1:
        return AirForce(DRAG_PER_S * forward_m_s, -DRAG_PER_S * down_m_s, 0.0)
    attack = math.atan2(down_m_s, forward_m_s)
    ahead, up, nose_up = (sum(parts) for parts in zip(*(p.force(attack, speed) for p in _PLATES), strict=True))
    ahead -= 0.5 * AIR_KG_M3 * forward_m_s * abs(forward_m_s) * FINS_M2 * PLATE_DRAG
    return AirForce(
        DRAG_PER_S * forward_m_s - ahead / MASS_KG, -DRAG_PER_S * down_m_s - up / MASS_KG, max(0.0, nose_up)
    )


def push_m_s2(throttle: float, airspeed_m_s: float) -> float:
    """Acceleration by the pusher propeller (SIH_F_CT0 to SIH_F_CT2)."""
    turns_per_s = PUSHER_REV_S * math.sqrt(max(0.0, min(1.0, throttle)))
    if turns_per_s < 1.0:
        return 0.0
    advance = airspeed_m_s / turns_per_s / PUSHER_M
    coefficient = max(0.0, 0.131 + 0.004 * advance - 0.146 * advance**2)
    return coefficient * AIR_KG_M3 * turns_per_s**2 * PUSHER_M**4 / MASS_KG


# PX4's position and velocity loops of a hovering VTOL, whose thrust the wing can use up.
#
# Nose down in fast hover flight the wing pushes down. The lift motors reach their limit, PX4 gives the height what it
# can of the thrust, and what is left holds the tilt, and with it the speed, below what was asked for
# [27_vtol_transitions].


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
        configured = float(self._params["MPC_THR_HOVER"])
        if not self._has_flown_on_the_wing:
            return configured
        return max(configured - HOVER_THRUST_RANGE, min(configured + HOVER_THRUST_RANGE, THRUST_SHARE))

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
