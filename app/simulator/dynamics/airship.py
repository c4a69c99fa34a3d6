"""An airship: slow, heavy, cannot brake: commanded to stop, it drifts on and comes back."""

from __future__ import annotations

import math

from app.simulator.dynamics.model import Wind
from app.simulator.geo import wrap_pi
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint, SetpointKind
from app.simulator.state import Body

ACCELERATION = 0.3
TURN_RATE_RAD_S = math.radians(12.0)
CLIMB_ACCELERATION = 0.3
HEIGHT_GAIN = 0.3
SLOWEST_M_S = 1.0
"""Below this airspeed the rudder has no effect, so it never goes slower on purpose."""

DOWN = (SetpointKind.LAND, SetpointKind.DESCEND)


class Airship:
    """Flies towards its point at all times."""

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
        idle = setpoint.kind is SetpointKind.IDLE
        if idle and body.on_ground:
            return
        self._climb(body, setpoint, dt_s)
        cruise = setpoint.cruise_speed_m_s
        wanted = cruise if cruise > 0.0 else float(self._params["MPC_XY_CRUISE"])
        if setpoint.kind in (SetpointKind.LOITER, SetpointKind.TAKEOFF, *DOWN):
            wanted = SLOWEST_M_S
        if body.on_ground:
            wanted = 0.0
        step = ACCELERATION * dt_s
        self._speed += max(-step, min(step, wanted - self._speed))
        to_target = (setpoint.north_m - body.north_m, setpoint.east_m - body.east_m)
        if math.hypot(*to_target) > 1.0 and setpoint.kind is not SetpointKind.DESCEND:
            turn = TURN_RATE_RAD_S * dt_s
            error = wrap_pi(math.atan2(to_target[1], to_target[0]) - body.yaw_rad)
            body.yaw_rad = wrap_pi(body.yaw_rad + max(-turn, min(turn, error)))
        afloat = 0.0 if body.on_ground else 1.0
        body.v_north_m_s = self._speed * math.cos(body.yaw_rad) + wind.north_m_s * afloat
        body.v_east_m_s = self._speed * math.sin(body.yaw_rad) + wind.east_m_s * afloat
        body.north_m += body.v_north_m_s * dt_s
        body.east_m += body.v_east_m_s * dt_s
        body.throttle = min(1.0, self._speed / 3.0)

    def _climb(self, body: Body, setpoint: Setpoint, dt_s: float) -> None:
        fastest = float(self._params["MPC_Z_V_AUTO_UP"])
        target_m = 0.0 if setpoint.kind in DOWN else setpoint.up_m
        command = max(-fastest, min(fastest, HEIGHT_GAIN * (target_m - body.up_m)))
        if setpoint.kind in DOWN:
            command = min(command, -0.2)
        step = CLIMB_ACCELERATION * dt_s
        body.v_up_m_s += max(-step, min(step, command - body.v_up_m_s))
        body.up_m = max(0.0, body.up_m + body.v_up_m_s * dt_s)
        if body.up_m == 0.0:
            body.v_up_m_s = 0.0
