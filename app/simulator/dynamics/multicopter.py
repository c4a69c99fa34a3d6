"""A multicopter: a smoothed trajectory point runs ahead, and a velocity loop with drag follows it.

The shape (a quick rise to about 80 % of the cruise speed, then a slow creep up; an overshoot of 0.8 m when stopping)
comes from PX4's own structure: position gain, velocity gain and integrator against drag, not from curve fitting.
"""

from __future__ import annotations

import math

from app.simulator.dynamics.flight_track import FlightTrack
from app.simulator.dynamics.ground_thrust import GroundThrust
from app.simulator.dynamics.model import Wind
from app.simulator.dynamics.position_smoothing import PositionSmoothing
from app.simulator.geo import wrap_pi
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint, SetpointKind
from app.simulator.state import Body, Status

POSITION_GAIN = 0.95  # MPC_XY_P
VELOCITY_GAIN = 1.8  # MPC_XY_VEL_P_ACC
VELOCITY_INTEGRAL_GAIN = 0.4  # MPC_XY_VEL_I_ACC
VELOCITY_DAMPING = 0.2  # MPC_XY_VEL_D_ACC
ATTITUDE_LAG_S = 0.15  # 1 / MC_ROLL_P
DRAG_PER_S = 1.0  # SIH_KDV over the mass
HEIGHT_GAIN = 1.0  # MPC_Z_P
VERTICAL_INTEGRAL_GAIN = 2.0  # MPC_Z_VEL_I_ACC
VERTICAL_GAIN = 4.0  # MPC_Z_VEL_P_ACC
YAW_DISTANCE_M = 2.0
YAW_RATE_RAD_S = math.radians(45.0)  # MPC_YAWRAUTO_MAX
MAX_TILT_ACCELERATION = 9.81  # MPC_TILTMAX_AIR 45 degrees
LAND_CRAWL_M = 0.6
LAND_CRAWL_M_S = 0.3


class Multicopter:
    """Dynamics of quads, hexas and hovering VTOLs."""

    def __init__(self, params: Params, status: Status, hover_throttle: float) -> None:
        self._params = params
        self._hover_throttle = hover_throttle
        self._ground = GroundThrust(params, status, hover_throttle)
        self._track = FlightTrack()
        self._trajectory = PositionSmoothing(params)
        self._integral = [0.0, 0.0, 0.0]
        self._thrust = [0.0, 0.0]
        self._flying = False

    def reset(self, body: Body) -> None:
        """Take over a body in any state (after a transition, a reboot or on the ground)."""
        self._track.reset()
        self._trajectory.reset(
            (body.north_m, body.east_m, body.up_m), (body.v_north_m_s, body.v_east_m_s, body.v_up_m_s)
        )
        self._integral = [0.0, 0.0, 0.0]
        self._thrust = [0.0, 0.0]
        self._flying = not body.on_ground
        self._ground.restart()

    def step(self, body: Body, setpoint: Setpoint, dt_s: float, wind: Wind) -> None:
        """Advance by `dt_s`; the vehicle is armed."""
        if not self._flying:
            self._stand(body, setpoint, dt_s)
            return
        self._smooth(body, setpoint, dt_s)
        self._horizontal(body, dt_s, wind)
        self._vertical(body, dt_s)
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

    def _smooth(self, body: Body, setpoint: Setpoint, dt_s: float) -> None:
        """Move the trajectory on towards the setpoint."""
        params = self._params
        here = (body.north_m, body.east_m, body.up_m)
        leg = self._track.leg(here, setpoint)
        landing = setpoint.kind is SetpointKind.LAND
        self._limit_climb(body, setpoint, landing)
        cruise = setpoint.cruise_speed_m_s if setpoint.cruise_speed_m_s > 0.0 else float(params["MPC_XY_CRUISE"])
        cruise = min(cruise, float(params["MPC_XY_VEL_MAX"]))
        self._trajectory.step(here, leg, cruise, self._land_speed(body.up_m) if landing else None, dt_s)

    def _limit_climb(self, body: Body, setpoint: Setpoint, landing: bool) -> None:
        params = self._params
        if landing or setpoint.up_m < self._trajectory.position[2]:
            self._trajectory.limit_climb(float(params["MPC_Z_V_AUTO_DN"]), float(params["MPC_ACC_DOWN_MAX"]))
            return
        velocity, acceleration = float(params["MPC_Z_V_AUTO_UP"]), float(params["MPC_ACC_UP_MAX"])
        if setpoint.kind is SetpointKind.TAKEOFF and body.up_m < float(params["MPC_LAND_ALT1"]):
            velocity = float(params["MPC_TKO_SPEED"])
            acceleration = min(acceleration, velocity / float(params["MPC_TKO_RAMP_T"]))
            self._trajectory.axes[2].position_m = body.up_m
        self._trajectory.limit_climb(velocity, acceleration)

    def _horizontal(self, body: Body, dt_s: float, wind: Wind) -> None:
        """Position and velocity loop against drag; the attitude follows a moment later."""
        params = self._params
        place, speed, air = (body.north_m, body.east_m), (body.v_north_m_s, body.v_east_m_s), (wind.north_m_s, wind.east_m_s)
        thrust = [0.0, 0.0]
        for axis in (0, 1):
            plan = self._trajectory.axes[axis]
            command = plan.velocity_m_s + POSITION_GAIN * (plan.position_m - place[axis])
            error = command - speed[axis]
            damping = VELOCITY_DAMPING * (self._thrust[axis] - DRAG_PER_S * (speed[axis] - air[axis]))
            thrust[axis] = plan.acceleration_m_s2 + VELOCITY_GAIN * error + self._integral[axis] - damping
            self._integral[axis] += VELOCITY_INTEGRAL_GAIN * error * dt_s
        size = math.hypot(*thrust)
        if size > MAX_TILT_ACCELERATION:
            thrust = [value * MAX_TILT_ACCELERATION / size for value in thrust]
        share = min(dt_s / ATTITUDE_LAG_S, 1.0)
        for axis in (0, 1):
            self._thrust[axis] += share * (thrust[axis] - self._thrust[axis])
        body.v_north_m_s += (self._thrust[0] - DRAG_PER_S * (body.v_north_m_s - wind.north_m_s)) * dt_s
        body.v_east_m_s += (self._thrust[1] - DRAG_PER_S * (body.v_east_m_s - wind.east_m_s)) * dt_s
        body.north_m += body.v_north_m_s * dt_s
        body.east_m += body.v_east_m_s * dt_s
        cos, sin = math.cos(body.yaw_rad), math.sin(body.yaw_rad)
        body.pitch_rad = -(self._thrust[0] * cos + self._thrust[1] * sin) / 9.81
        body.roll_rad = (-self._thrust[0] * sin + self._thrust[1] * cos) / 9.81

    def _land_speed(self, height_m: float) -> float:
        params = self._params
        high, low = float(params["MPC_LAND_ALT1"]), float(params["MPC_LAND_ALT2"])
        fast, slow = float(params["MPC_Z_V_AUTO_DN"]), float(params["MPC_LAND_SPEED"])
        if height_m < LAND_CRAWL_M:
            return LAND_CRAWL_M_S
        share = max(0.0, min(1.0, (height_m - low) / max(high - low, 0.1)))
        return slow + share * (fast - slow)

    def _vertical(self, body: Body, dt_s: float) -> None:
        plan = self._trajectory.axes[2]
        body.climb_command_m_s = plan.velocity_m_s + HEIGHT_GAIN * (plan.position_m - body.up_m)
        error = body.climb_command_m_s - body.v_up_m_s
        acceleration = plan.acceleration_m_s2 + VERTICAL_GAIN * error + self._integral[2]
        self._integral[2] += VERTICAL_INTEGRAL_GAIN * error * dt_s
        body.v_up_m_s += (acceleration - DRAG_PER_S * body.v_up_m_s) * dt_s
        body.up_m = max(0.0, body.up_m + body.v_up_m_s * dt_s)
        body.throttle = max(0.1, min(1.0, self._hover_throttle + 0.05 * body.v_up_m_s))
        self.probe = " ".join(f"{x.position_m:.2f}" for x in self._trajectory.axes)

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
