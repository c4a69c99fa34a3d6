"""A multicopter: a smoothed trajectory point runs ahead, and a velocity loop with drag follows it.

The shape (a quick rise to about 80 % of the cruise speed, then a slow creep up; an overshoot of 0.8 m when stopping)
comes from PX4's own structure: position gain, velocity gain and integrator against drag, not from curve fitting.
"""

from __future__ import annotations

import math

from app.simulator.dynamics.ground_thrust import GroundThrust
from app.simulator.dynamics.model import Wind
from app.simulator.dynamics.trajectory import speed_in_turn_m_s, speed_to_stop_m_s
from app.simulator.geo import wrap_pi
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint, SetpointKind
from app.simulator.state import Body, Status

POSITION_GAIN = 0.95  # MPC_XY_P
VELOCITY_GAIN = 1.8  # MPC_XY_VEL_P_ACC
VELOCITY_INTEGRAL_GAIN = 0.4  # MPC_XY_VEL_I_ACC
ERROR_MAX_M = 2.0  # MPC_XY_ERR_MAX
DRAG_PER_S = 1.0  # SIH_KDV over the mass
VERTICAL_GAIN = 4.0  # MPC_Z_VEL_P_ACC
YAW_DISTANCE_M = 2.0
YAW_RATE_RAD_S = math.radians(45.0)  # MPC_YAWRAUTO_MAX
MAX_TILT_ACCELERATION = 9.81  # MPC_TILTMAX_AIR 45 degrees
VERTICAL_ACCELERATION = 4.0  # MPC_ACC_UP_MAX
LAND_CRAWL_M = 0.6
LAND_CRAWL_M_S = 0.3


class Multicopter:
    """Dynamics of quads, hexas and hovering VTOLs."""

    def __init__(self, params: Params, status: Status, hover_throttle: float) -> None:
        self._params = params
        self._hover_throttle = hover_throttle
        self._ground = GroundThrust(params, status, hover_throttle)
        self._trajectory = (0.0, 0.0)
        self._trajectory_speed = 0.0
        self._trajectory_acceleration = 0.0
        self._integral = (0.0, 0.0)
        self._flying = False

    def reset(self, body: Body) -> None:
        """Take over a body in any state (after a transition, a reboot or on the ground)."""
        self._trajectory = (body.north_m, body.east_m)
        self._trajectory_speed = body.ground_speed_m_s
        self._trajectory_acceleration = 0.0
        self._integral = (0.0, 0.0)
        self._flying = not body.on_ground
        self._ground.restart()

    def step(self, body: Body, setpoint: Setpoint, dt_s: float, wind: Wind) -> None:
        """Advance by `dt_s`; the vehicle is armed."""
        if not self._flying:
            self._stand(body, setpoint, dt_s)
            return
        command = self._velocity_command(body, setpoint, dt_s)
        self._horizontal(body, command, dt_s, wind)
        body.climb_command_m_s = self._climb_command(body, setpoint)
        self._vertical(body, body.climb_command_m_s, dt_s)
        self._turn(body, setpoint, dt_s)
        if body.up_m <= 0.0 and body.climb_command_m_s < 0.0:
            self._touch_down(body)

    def transition(self, wanted: int) -> None:
        """No VTOL."""

    def _stand(self, body: Body, setpoint: Setpoint, dt_s: float) -> None:
        """On the ground: the motors spin up to a takeoff, or push down until the landing is detected."""
        wants_up = setpoint.kind not in (SetpointKind.IDLE, SetpointKind.LAND) and setpoint.up_m > body.up_m + 0.1
        body.climb_command_m_s = float(self._params["MPC_TKO_SPEED"]) if wants_up else -LAND_CRAWL_M_S
        body.throttle = self._ground.step(body.throttle, body.climb_command_m_s, dt_s)
        if wants_up and body.throttle >= self._hover_throttle:
            self.reset(body)
            self._flying = True
            body.up_m = 0.02

    def _touch_down(self, body: Body) -> None:
        body.up_m = body.v_up_m_s = body.v_north_m_s = body.v_east_m_s = 0.0
        body.roll_rad = body.pitch_rad = 0.0
        self._flying = False
        self._ground.touch_down()

    def _velocity_command(self, body: Body, setpoint: Setpoint, dt_s: float) -> tuple[float, float]:
        """Move the trajectory point towards the setpoint and return the velocity that follows it."""
        params = self._params
        acceleration, jerk = float(params["MPC_ACC_HOR"]), float(params["MPC_JERK_AUTO"])
        here = self._trajectory
        to_target = (setpoint.north_m - here[0], setpoint.east_m - here[1])
        distance_m = math.hypot(*to_target)
        cruise = setpoint.cruise_speed_m_s
        limit = min(cruise if cruise > 0.0 else float(params["MPC_XY_CRUISE"]), float(params["MPC_XY_VEL_MAX"]))
        final = 0.0
        if setpoint.next is not None and setpoint.kind is SetpointKind.POSITION:
            radius_m = setpoint.acceptance_radius_m
            final = min(limit, speed_in_turn_m_s(here, setpoint.point, setpoint.next, acceleration, radius_m))
        wanted = min(limit, speed_to_stop_m_s(distance_m, acceleration, jerk, final))
        self._accelerate(wanted, acceleration, jerk, dt_s)
        unit = (to_target[0] / distance_m, to_target[1] / distance_m) if distance_m > 1e-6 else (0.0, 0.0)
        behind_m = (here[0] - body.north_m) * unit[0] + (here[1] - body.east_m) * unit[1]
        stretch = 1.0 - max(0.0, min(behind_m / ERROR_MAX_M, 1.0))  # the trajectory waits for the vehicle
        move_m = min(self._trajectory_speed * stretch * dt_s, distance_m)
        self._trajectory = (here[0] + unit[0] * move_m, here[1] + unit[1] * move_m)
        error = (self._trajectory[0] - body.north_m, self._trajectory[1] - body.east_m)
        feed = self._trajectory_speed
        return unit[0] * feed + POSITION_GAIN * error[0], unit[1] * feed + POSITION_GAIN * error[1]

    def _accelerate(self, wanted_m_s: float, limit_m_s2: float, jerk_m_s3: float, dt_s: float) -> None:
        """Bring the trajectory's speed to `wanted_m_s` within the limits of acceleration and jerk."""
        missing = wanted_m_s - self._trajectory_speed
        gentle = math.copysign(math.sqrt(2.0 * jerk_m_s3 * abs(missing)), missing)
        target = max(-limit_m_s2, min(limit_m_s2, gentle))
        step = jerk_m_s3 * dt_s
        self._trajectory_acceleration += max(-step, min(step, target - self._trajectory_acceleration))
        self._trajectory_speed = max(0.0, self._trajectory_speed + self._trajectory_acceleration * dt_s)

    def _horizontal(self, body: Body, command: tuple[float, float], dt_s: float, wind: Wind) -> None:
        error = (command[0] - body.v_north_m_s, command[1] - body.v_east_m_s)
        self._integral = (
            self._integral[0] + VELOCITY_INTEGRAL_GAIN * error[0] * dt_s,
            self._integral[1] + VELOCITY_INTEGRAL_GAIN * error[1] * dt_s,
        )
        thrust = [VELOCITY_GAIN * error[axis] + self._integral[axis] for axis in (0, 1)]
        size = math.hypot(*thrust)
        limit = MAX_TILT_ACCELERATION
        if size > limit:
            thrust = [value * limit / size for value in thrust]
        body.v_north_m_s += (thrust[0] - DRAG_PER_S * (body.v_north_m_s - wind.north_m_s)) * dt_s
        body.v_east_m_s += (thrust[1] - DRAG_PER_S * (body.v_east_m_s - wind.east_m_s)) * dt_s
        body.north_m += body.v_north_m_s * dt_s
        body.east_m += body.v_east_m_s * dt_s
        cos, sin = math.cos(body.yaw_rad), math.sin(body.yaw_rad)
        body.pitch_rad = -(thrust[0] * cos + thrust[1] * sin) / 9.81
        body.roll_rad = (-thrust[0] * sin + thrust[1] * cos) / 9.81

    def _climb_command(self, body: Body, setpoint: Setpoint) -> float:
        params = self._params
        if setpoint.kind is SetpointKind.LAND:
            return -self._land_speed(body.up_m)
        height_m = setpoint.up_m - body.up_m
        if setpoint.kind is SetpointKind.TAKEOFF and body.up_m < float(params["MPC_LAND_ALT1"]):
            up = float(params["MPC_TKO_SPEED"])
        else:
            up = float(params["MPC_Z_V_AUTO_UP"])
        limit = up if height_m > 0.0 else float(params["MPC_Z_V_AUTO_DN"])
        jerk = float(params["MPC_JERK_AUTO"])
        return math.copysign(min(limit, speed_to_stop_m_s(abs(height_m), VERTICAL_ACCELERATION, jerk)), height_m)

    def _land_speed(self, height_m: float) -> float:
        params = self._params
        high, low = float(params["MPC_LAND_ALT1"]), float(params["MPC_LAND_ALT2"])
        fast, slow = float(params["MPC_Z_V_AUTO_DN"]), float(params["MPC_LAND_SPEED"])
        if height_m < LAND_CRAWL_M:
            return LAND_CRAWL_M_S
        share = max(0.0, min(1.0, (height_m - low) / max(high - low, 0.1)))
        return slow + share * (fast - slow)

    def _vertical(self, body: Body, command_m_s: float, dt_s: float) -> None:
        change = VERTICAL_GAIN * (command_m_s - body.v_up_m_s) * dt_s
        limit = VERTICAL_ACCELERATION * dt_s
        body.v_up_m_s += max(-limit, min(limit, change))
        body.up_m = max(0.0, body.up_m + body.v_up_m_s * dt_s)
        body.throttle = max(0.1, min(1.0, self._hover_throttle + 0.05 * body.v_up_m_s))

    def _turn(self, body: Body, setpoint: Setpoint, dt_s: float) -> None:
        """To the heading asked for, else along the track (MPC_YAW_MODE 0) while the target is far enough away."""
        to_target = (setpoint.north_m - body.north_m, setpoint.east_m - body.east_m)
        wanted = setpoint.yaw_rad
        travelling = setpoint.kind in (SetpointKind.POSITION, SetpointKind.LOITER)
        if math.isnan(wanted) and travelling and math.hypot(*to_target) > YAW_DISTANCE_M:
            wanted = math.atan2(to_target[1], to_target[0])
        if math.isfinite(wanted):
            step = YAW_RATE_RAD_S * dt_s
            body.yaw_rad = wrap_pi(body.yaw_rad + max(-step, min(step, wrap_pi(wanted - body.yaw_rad))))
