"""PX4's position and velocity loops in the air, and what the airframe makes of them (drag of PX4's SIH simulator)."""

from __future__ import annotations

import math
from collections.abc import Sequence

from app.simulator.dynamics.model import Wind
from app.simulator.dynamics.velocity_smoothing import VelocitySmoothing
from app.simulator.state import Body

POSITION_GAIN = 0.95  # MPC_XY_P
VELOCITY_GAIN = 1.8  # MPC_XY_VEL_P_ACC
VELOCITY_INTEGRAL_GAIN = 0.4  # MPC_XY_VEL_I_ACC
VELOCITY_DAMPING = 0.2  # MPC_XY_VEL_D_ACC
HEIGHT_GAIN = 1.0  # MPC_Z_P
CLIMB_GAIN = 4.0  # MPC_Z_VEL_P_ACC
CLIMB_INTEGRAL_GAIN = 2.0  # MPC_Z_VEL_I_ACC
DRAG_PER_S = 1.0  # SIH_KDV over the mass
ATTITUDE_LAG_S = 0.15  # 1 / MC_ROLL_P
TILT_MAX_M_S2 = 9.81  # MPC_TILTMAX_AIR 45 degrees
GRAVITY_M_S2 = 9.81
ANTI_WINDUP_GAIN = 2.0 / VELOCITY_GAIN
HOVER_ESTIMATE_S = 10.0
"""PX4 takes the drag of a climb for weight and believes in too high a hover thrust for so long [15_hot_swap]."""


class PositionControl:
    """Follows the axes of a trajectory: its acceleration, plus what the errors of speed and place ask for."""

    def __init__(self) -> None:
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

    def step(
        self, body: Body, axes: Sequence[VelocitySmoothing], dt_s: float, wind: Wind, *, level: bool = False
    ) -> None:
        """Advance speed, place and attitude by `dt_s`. `level`: without a position there is no horizontal control."""
        north = self._acceleration(0, axes[0], body.north_m, body.v_north_m_s, wind.north_m_s, dt_s)
        east = self._acceleration(1, axes[1], body.east_m, body.v_east_m_s, wind.east_m_s, dt_s)
        if level:
            north = east = self._integral[0] = self._integral[1] = 0.0
        size = math.hypot(north, east)
        if size > TILT_MAX_M_S2:
            north, east = north * TILT_MAX_M_S2 / size, east * TILT_MAX_M_S2 / size
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

    def _acceleration(
        self, index: int, plan: VelocitySmoothing, place_m: float, speed_m_s: float, air_m_s: float, dt_s: float
    ) -> float:
        """What one horizontal axis wants."""
        error = plan.velocity_m_s + POSITION_GAIN * (plan.position_m - place_m) - speed_m_s
        gained = self._thrust[index] - DRAG_PER_S * (speed_m_s - air_m_s)
        wanted = plan.acceleration_m_s2 + VELOCITY_GAIN * error + self._integral[index] - VELOCITY_DAMPING * gained
        missing = wanted * self._missing_share
        self._integral[index] += VELOCITY_INTEGRAL_GAIN * (error - ANTI_WINDUP_GAIN * missing) * dt_s
        return wanted

    def _climb(self, body: Body, plan: VelocitySmoothing, dt_s: float) -> None:
        body.climb_command_m_s = plan.velocity_m_s + HEIGHT_GAIN * (plan.position_m - body.up_m)
        error = body.climb_command_m_s - body.v_up_m_s
        acceleration = plan.acceleration_m_s2 + CLIMB_GAIN * error + self._integral[2]
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
