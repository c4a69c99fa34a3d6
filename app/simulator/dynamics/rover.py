"""A rover with Ackermann steering: slows for corners and stops at its last point."""

from __future__ import annotations

import math

from app.simulator.dynamics.model import Wind
from app.simulator.dynamics.path import course_on_line
from app.simulator.dynamics.position_smoothing import speed_to_stop_m_s
from app.simulator.geo import wrap_pi
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint, SetpointKind
from app.simulator.state import Body

ACCELERATION = 4.0
DECELERATION = 2.0
JERK = 4.0
CRUISE_M_S = 3.1
CORNER_M_S = 2.1
TURN_RADIUS_M = 0.64
LOOKAHEAD_M = 2.0
STOP_RADIUS_M = 0.15


class Rover:
    """Dynamics of ground vehicles: no height, no wind."""

    def __init__(self, params: Params) -> None:
        self._params = params
        self._speed = 0.0

    def reset(self, body: Body) -> None:
        """Take over a body in any state."""
        self._speed = body.ground_speed_m_s

    def transition(self, wanted: int) -> None:
        """No VTOL."""

    def step(self, body: Body, setpoint: Setpoint, dt_s: float, wind: Wind) -> None:
        """Advance by `dt_s`; the vehicle is armed."""
        distance_m = math.hypot(setpoint.north_m - body.north_m, setpoint.east_m - body.east_m)
        wanted = self._speed_command(setpoint, distance_m)
        step = ACCELERATION * dt_s
        self._speed = max(0.0, self._speed + max(-step, min(step, wanted - self._speed)))
        if self._speed > 0.05:
            course = course_on_line((body.north_m, body.east_m), setpoint.previous, setpoint.point, LOOKAHEAD_M)
            if distance_m < LOOKAHEAD_M:
                course = math.atan2(setpoint.east_m - body.east_m, setpoint.north_m - body.north_m)
            turn = self._speed / TURN_RADIUS_M * dt_s
            body.yaw_rad = wrap_pi(body.yaw_rad + max(-turn, min(turn, wrap_pi(course - body.yaw_rad))))
        body.v_north_m_s = self._speed * math.cos(body.yaw_rad)
        body.v_east_m_s = self._speed * math.sin(body.yaw_rad)
        body.north_m += body.v_north_m_s * dt_s
        body.east_m += body.v_east_m_s * dt_s
        body.throttle = min(1.0, self._speed / CRUISE_M_S)

    def _speed_command(self, setpoint: Setpoint, distance_m: float) -> float:
        if setpoint.kind in (SetpointKind.IDLE, SetpointKind.DESCEND) or distance_m < STOP_RADIUS_M:
            return 0.0
        cruise = setpoint.cruise_speed_m_s if setpoint.cruise_speed_m_s > 0.0 else CRUISE_M_S
        corner = setpoint.next is not None and distance_m > 2.0 * TURN_RADIUS_M
        final = min(cruise, CORNER_M_S) if corner else 0.0
        return min(cruise, speed_to_stop_m_s(distance_m, DECELERATION, JERK, final))
