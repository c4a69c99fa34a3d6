"""PX4's position and velocity loops in the air, and what the airframe makes of them (drag of PX4's SIH simulator)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

from app.simulator.dynamics.model import Wind
from app.simulator.params import Params
from app.simulator.state import Body

POSITION_GAIN = 0.95  # MPC_XY_P
VELOCITY_GAIN = 1.8  # MPC_XY_VEL_P_ACC
VELOCITY_INTEGRAL_GAIN = 0.4  # MPC_XY_VEL_I_ACC
VELOCITY_DAMPING = 0.2  # MPC_XY_VEL_D_ACC
HEIGHT_GAIN = 1.0  # MPC_Z_P
CLIMB_GAIN = 4.0  # MPC_Z_VEL_P_ACC
CLIMB_INTEGRAL_GAIN = 2.0  # MPC_Z_VEL_I_ACC
DRAG_PER_S = 1.0  # SIH_KDV over the mass
ATTITUDE_LAG_S = 0.25  # 1 / MC_ROLL_P
TILT_MAX_M_S2 = 9.81  # MPC_TILTMAX_AIR 45 degrees
GRAVITY_M_S2 = 9.81
ANTI_WINDUP_GAIN = 2.0 / VELOCITY_GAIN
HOVER_ESTIMATE_S = 10.0
"""PX4 takes the drag of a climb for weight and believes in too high a hover thrust for so long [15_hot_swap]."""


class Axis(Protocol):
    """One axis of a trajectory setpoint; NaN is not given."""

    position_m: float
    velocity_m_s: float
    acceleration_m_s2: float


class PositionControl:
    """Follows three axes: their acceleration, plus what the errors of speed and place ask for."""

    def __init__(self, params: Params) -> None:
        self._params = params
        self._integral = [0.0, 0.0, 0.0]
        self._thrust = [0.0, 0.0]
        self._hover_excess = 0.0
        self._missing_share = 0.0
        """Of the horizontal acceleration: the controller sees that its thrust falls short by this."""

    def reset(self) -> None:
        """Level, and nothing learnt."""
        self._integral = [0.0, 0.0, 0.0]
        self._thrust = [0.0, 0.0]
        self._hover_excess = self._missing_share = 0.0

    def step(self, body: Body, axes: Sequence[Axis], dt_s: float, wind: Wind, *, level: bool = False) -> None:
        """Advance speed, place and attitude by `dt_s`. `level`: without a position there is no horizontal control."""
        if level:
            north = east = self._integral[0] = self._integral[1] = 0.0
        else:
            north, east = self._tilt(body, axes, dt_s, wind)
        thrust, share = self._thrust, min(dt_s / ATTITUDE_LAG_S, 1.0)
        thrust[0] += share * (north - thrust[0])
        thrust[1] += share * (east - thrust[1])
        body.v_north_m_s += (thrust[0] - DRAG_PER_S * (body.v_north_m_s - wind.north_m_s)) * dt_s
        body.v_east_m_s += (thrust[1] - DRAG_PER_S * (body.v_east_m_s - wind.east_m_s)) * dt_s
        body.north_m += body.v_north_m_s * dt_s
        body.east_m += body.v_east_m_s * dt_s
        cos, sin = math.cos(body.yaw_rad), math.sin(body.yaw_rad)
        body.pitch_rad = -(thrust[0] * cos + thrust[1] * sin) / GRAVITY_M_S2
        body.roll_rad = (-thrust[0] * sin + thrust[1] * cos) / GRAVITY_M_S2
        self._climb(body, axes[2], dt_s)

    def _tilt(self, body: Body, axes: Sequence[Axis], dt_s: float, wind: Wind) -> tuple[float, float]:
        """The horizontal acceleration that the vehicle leans for; of what it cannot, the integrator unlearns."""
        integral, thrust = self._integral, self._thrust
        velocity = velocity_command(body, axes, float(self._params["MPC_XY_VEL_MAX"]))
        if velocity is None:  # only accelerations: PX4 resets the integrators
            integral[0] = integral[1] = error_north = error_east = 0.0
            north, east = or_zero(axes[0].acceleration_m_s2), or_zero(axes[1].acceleration_m_s2)
        else:
            error_north, error_east = velocity[0] - body.v_north_m_s, velocity[1] - body.v_east_m_s
            gained_north = thrust[0] - DRAG_PER_S * (body.v_north_m_s - wind.north_m_s)
            gained_east = thrust[1] - DRAG_PER_S * (body.v_east_m_s - wind.east_m_s)
            north = VELOCITY_GAIN * error_north + integral[0] - VELOCITY_DAMPING * gained_north
            east = VELOCITY_GAIN * error_east + integral[1] - VELOCITY_DAMPING * gained_east
            north += or_zero(axes[0].acceleration_m_s2)
            east += or_zero(axes[1].acceleration_m_s2)
        size = math.hypot(north, east)
        share = TILT_MAX_M_S2 / size if size > TILT_MAX_M_S2 else 1.0
        missing = ANTI_WINDUP_GAIN * (1.0 - share * (1.0 - self._missing_share))
        integral[0] += VELOCITY_INTEGRAL_GAIN * (error_north - missing * north) * dt_s
        integral[1] += VELOCITY_INTEGRAL_GAIN * (error_east - missing * east) * dt_s
        return share * north, share * east

    def _climb(self, body: Body, axis: Axis, dt_s: float) -> None:
        params = self._params
        back = or_zero(HEIGHT_GAIN * (axis.position_m - body.up_m))
        wanted = or_zero(axis.velocity_m_s) + back
        fastest, slowest = float(params["MPC_Z_VEL_MAX_UP"]), -float(params["MPC_Z_VEL_MAX_DN"])
        body.climb_command_m_s = max(slowest, min(fastest, wanted))
        error = body.climb_command_m_s - body.v_up_m_s
        acceleration = or_zero(axis.acceleration_m_s2) + CLIMB_GAIN * error + self._integral[2]
        self._integral[2] += CLIMB_INTEGRAL_GAIN * error * dt_s
        gained = acceleration - DRAG_PER_S * body.v_up_m_s
        self._watch_hover_thrust(GRAVITY_M_S2 + acceleration, GRAVITY_M_S2 + gained, dt_s)
        body.v_up_m_s += gained * dt_s
        body.up_m = max(0.0, body.up_m + body.v_up_m_s * dt_s)

    def _watch_hover_thrust(self, thrust_m_s2: float, felt_m_s2: float, dt_s: float) -> None:
        """The hover thrust estimate, and with it what is missing of the horizontal thrust (tracking anti-windup)."""
        seen = thrust_m_s2 / max(felt_m_s2, 1.0) - 1.0
        self._hover_excess += (seen - self._hover_excess) * dt_s / HOVER_ESTIMATE_S
        self._missing_share = max(0.0, 1.0 - thrust_m_s2 / GRAVITY_M_S2 / (1.0 + self._hover_excess))


def velocity_command(body: Body, axes: Sequence[Axis], fastest_m_s: float) -> tuple[float, float] | None:
    """North and east: as given, and back to the place; beyond `fastest_m_s` the way back comes first.

    None: neither place nor velocity is given.
    """
    north, east = axes[0], axes[1]
    ahead = or_zero(north.velocity_m_s), or_zero(east.velocity_m_s)
    back = POSITION_GAIN * (north.position_m - body.north_m), POSITION_GAIN * (east.position_m - body.east_m)
    if all(map(math.isnan, (*back, north.velocity_m_s, east.velocity_m_s))):
        return None
    return _constrained((or_zero(back[0]), or_zero(back[1])), ahead, fastest_m_s)


def or_zero(part: float) -> float:
    """What is not given has no influence."""
    return 0.0 if math.isnan(part) else part


def _constrained(first: tuple[float, float], second: tuple[float, float], most: float) -> tuple[float, float]:
    """The sum, no longer than `most`; what is too much is taken from the second (ControlMath::constrainXY)."""
    both = first[0] + second[0], first[1] + second[1]
    if math.hypot(*both) <= most:
        return both
    size, length = math.hypot(*first), math.hypot(*second)
    if size >= most or length == 0.0:
        return first[0] * most / size, first[1] * most / size
    unit = second[0] / length, second[1] / length
    along = unit[0] * first[0] + unit[1] * first[1]
    share = -along + math.sqrt(along * along - size * size + most * most)
    return first[0] + share * unit[0], first[1] + share * unit[1]
