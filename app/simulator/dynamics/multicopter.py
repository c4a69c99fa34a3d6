"""A multicopter: a smoothed trajectory point runs ahead, and a velocity loop with drag follows it.

The shape (a quick rise to about 80 % of the cruise speed, then a slow creep up; an overshoot of 0.8 m when stopping;
a turn that swings out by some metres and a slow leg after it) comes from PX4's own structure, not from curve fitting.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from app.simulator.dynamics.flight_task import LAND_CRAWL_M_S, FlightTask
from app.simulator.dynamics.ground_thrust import GroundThrust
from app.simulator.dynamics.model import Wind
from app.simulator.dynamics.position_control import Axis, PositionControl
from app.simulator.dynamics.winged_control import WingedControl
from app.simulator.geo import wrap_pi
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint, SetpointKind
from app.simulator.state import Body, Status

YAW_DISTANCE_M = 2.0
YAW_RATE_RAD_S = math.radians(60.0)  # MPC_YAWRAUTO_MAX
YAW_ACCELERATION_RAD_S2 = math.radians(20.0)  # MPC_YAWRAUTO_ACC
TAKEOFF_RISE_M = 0.1
THROTTLE_PER_M_S = 0.05
STAYS_DOWN = (SetpointKind.IDLE, SetpointKind.LAND, SetpointKind.DESCEND)


class Multicopter:
    """Dynamics of quads, hexas and hovering VTOLs."""

    def __init__(
        self, params: Params, status: Status, hover_throttle: float, control: WingedControl | None = None
    ) -> None:
        self._params = params
        self._hover_throttle = hover_throttle
        self._ground = GroundThrust(params, status, hover_throttle)
        self._task = FlightTask(params)
        self._control = control or PositionControl(params)
        self._flying = False
        self._yaw_rate_rad_s = 0.0

    def reset(self, body: Body) -> None:
        """Take over a body in any state (after a transition, a reboot or on the ground)."""
        self._task.reset(body)
        self._control.reset()
        self._yaw_rate_rad_s = 0.0
        self._flying = not body.on_ground
        self._ground.restart()

    def step(self, body: Body, setpoint: Setpoint, dt_s: float, wind: Wind) -> None:
        """Advance by `dt_s`; the vehicle is armed."""
        if not self._flying:
            self._stand(body, setpoint, dt_s)
            return
        self._control.step(
            body, self._axes(body, setpoint, dt_s), dt_s, wind, level=setpoint.kind is SetpointKind.DESCEND
        )
        body.throttle = max(0.1, min(1.0, self._hover_throttle + THROTTLE_PER_M_S * body.v_up_m_s))
        self._turn(body, setpoint, dt_s)
        if body.up_m <= 0.0 and body.climb_command_m_s < 0.0:
            self._touch_down(body)

    def transition(self, wanted: int) -> None:
        """No VTOL."""

    def _axes(self, body: Body, setpoint: Setpoint, dt_s: float) -> Sequence[Axis]:
        """What the controller follows: the flight task's way, or what comes from outside."""
        if setpoint.kind is SetpointKind.TRAJECTORY:
            self._task.reset(body)  # a mode that comes after it begins here
            return setpoint.axes
        self._task.step(body, setpoint, dt_s)
        return self._task.axes

    def _stand(self, body: Body, setpoint: Setpoint, dt_s: float) -> None:
        """On the ground: the motors spin up to a takeoff, or push down until the landing is detected."""
        wants_up = setpoint.kind not in STAYS_DOWN and setpoint.up_m > body.up_m + TAKEOFF_RISE_M
        body.climb_command_m_s = float(self._params["MPC_TKO_SPEED"]) if wants_up else -LAND_CRAWL_M_S
        takes_off = setpoint.kind is not SetpointKind.POSITION
        body.throttle = self._ground.step(body.throttle, body.climb_command_m_s, dt_s, takes_off=takes_off)
        if wants_up and body.throttle >= self._hover_throttle:
            self.reset(body)
            if not takes_off:
                self._task.climb_at(self._ground.climb_ramp_m_s2)
            self._flying = True
            body.up_m = 0.02

    def _touch_down(self, body: Body) -> None:
        body.up_m = body.v_up_m_s = body.v_north_m_s = body.v_east_m_s = 0.0
        body.roll_rad = body.pitch_rad = 0.0
        self._flying = False
        self._ground.touch_down()

    def _turn(self, body: Body, setpoint: Setpoint, dt_s: float) -> None:
        """To the heading asked for, else along the track (MPC_YAW_MODE 0) while the target is far enough away."""
        to_target = (setpoint.north_m - body.north_m, setpoint.east_m - body.east_m)
        wanted = setpoint.yaw_rad
        travelling = setpoint.kind in (SetpointKind.POSITION, SetpointKind.LOITER)
        if math.isnan(wanted) and travelling and math.hypot(*to_target) > YAW_DISTANCE_M:
            wanted = math.atan2(to_target[1], to_target[0])
        missing = wrap_pi(wanted - body.yaw_rad) if math.isfinite(wanted) else 0.0
        fastest = min(YAW_RATE_RAD_S, math.sqrt(2.0 * YAW_ACCELERATION_RAD_S2 * abs(missing)), abs(missing) / dt_s)
        change = YAW_ACCELERATION_RAD_S2 * dt_s
        rate = math.copysign(fastest, missing)
        self._yaw_rate_rad_s += max(-change, min(change, rate - self._yaw_rate_rad_s))
        body.yaw_rad = wrap_pi(body.yaw_rad + self._yaw_rate_rad_s * dt_s)
