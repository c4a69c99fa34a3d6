"""A rover with Ackermann steering: slows for corners and stops at its last point.

How fast it is depends on where it goes: PX4's SIH takes the square of the speed for its drag along each axis of the
earth (ECEF) by itself, so that near Zurich what drives 3.0 m/s north drives 2.5 m/s east [13_rover_delivery].
"""

from __future__ import annotations

import math

from app.simulator.dynamics.model import Wind
from app.simulator.dynamics.path import course_on_line
from app.simulator.dynamics.position_smoothing import speed_to_stop_m_s
from app.simulator.geo import LocalFrame, wrap_pi
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint, SetpointKind
from app.simulator.state import Body

ACCELERATION = 3.0  # RO_ACCEL_LIM
DECELERATION = 3.0  # RO_DECEL_LIM
JERK = 10.0  # RO_JERK_LIM
CRUISE_M_S = 3.0  # RO_SPEED_LIM
FULL_M_S = 3.2  # RO_MAX_THR_SPEED: what full throttle is taken for
SLOWEST_TURN_M_S = 1.75
"""RA_WHEEL_BASE, RO_YAW_RATE_LIM and RA_MAX_STR_ANG: slower it is not made for a turn."""
TURN_RADIUS_M = 0.64
CORNER_GAIN, CORNER_MAX_M = 2.0, 3.0  # RA_ACC_RAD_GAIN, RA_ACC_RAD_MAX
LEAST_AHEAD_M = 1.0  # PP_LOOKAHD_MIN
MASS_KG = 20.0  # SIH_MASS
FULL_N = 400.0
ROLLING_N = 0.3 * MASS_KG * 9.81
DRAG = 50.0  # SIH_KDV


class Rover:
    """Dynamics of ground vehicles: no height, no wind."""

    def __init__(self, params: Params, frame: LocalFrame) -> None:
        self._params = params
        self._frame = frame
        self._speed = 0.0
        self._commanded = 0.0

    def reset(self, body: Body) -> None:
        """Take over a body in any state."""
        self._speed = self._commanded = body.ground_speed_m_s

    def transition(self, wanted: int) -> None:
        """No VTOL."""

    def step(self, body: Body, setpoint: Setpoint, dt_s: float, wind: Wind) -> None:
        """Advance by `dt_s`; the vehicle is armed."""
        wanted_m_s, missing = self._way(body, setpoint)
        if wanted_m_s == 0.0:
            missing = 0.0  # there: it keeps its heading (AckermannPosControl)
        self._push(wanted_m_s, body.yaw_rad, dt_s)
        if self._speed > 0.05:
            turn = self._speed / TURN_RADIUS_M * dt_s
            body.yaw_rad = wrap_pi(body.yaw_rad + max(-turn, min(turn, missing)))
        body.v_north_m_s = self._speed * math.cos(body.yaw_rad)
        body.v_east_m_s = self._speed * math.sin(body.yaw_rad)
        body.north_m += body.v_north_m_s * dt_s
        body.east_m += body.v_east_m_s * dt_s
        body.throttle = min(1.0, self._speed / CRUISE_M_S)

    def _way(self, body: Body, setpoint: Setpoint) -> tuple[float, float]:
        """Speed, and the angle to turn. Without a point it goes on as before: AckermannPosControl publishes nothing."""
        if math.isnan(setpoint.north_m):
            return self._commanded, 0.0
        distance_m = math.hypot(setpoint.north_m - body.north_m, setpoint.east_m - body.east_m)
        ahead_m = max(LEAST_AHEAD_M, self._speed)
        course = course_on_line((body.north_m, body.east_m), setpoint.previous, setpoint.point, ahead_m)
        if distance_m < ahead_m:
            course = math.atan2(setpoint.east_m - body.east_m, setpoint.north_m - body.north_m)
        missing = wrap_pi(course - body.yaw_rad)
        return self._speed_command(setpoint, distance_m, abs(missing)), missing

    def _push(self, wanted_m_s: float, yaw_rad: float, dt_s: float) -> None:
        """The throttle for a speed against friction and drag; the speed controller's gains are next to none."""
        rise, fall = ACCELERATION * dt_s, DECELERATION * dt_s
        self._commanded += max(-fall, min(rise, wanted_m_s - self._commanded))
        if wanted_m_s == 0.0:
            self._commanded = 0.0
        drag_n = DRAG * _drag_share(self._frame, yaw_rad) * self._speed**2
        force_n = FULL_N * self._commanded / FULL_M_S - ROLLING_N - drag_n
        self._speed = max(0.0, self._speed + force_n / MASS_KG * dt_s)

    def _speed_command(self, setpoint: Setpoint, distance_m: float, missing_rad: float) -> float:
        if setpoint.kind in (SetpointKind.IDLE, SetpointKind.DESCEND):
            return 0.0
        cruise = min(setpoint.cruise_speed_m_s, CRUISE_M_S) if setpoint.cruise_speed_m_s > 0.0 else CRUISE_M_S
        arrival, reach_m = self._arrival(setpoint, cruise)
        if arrival == 0.0 and distance_m <= reach_m:
            return 0.0
        left_m = max(0.0, distance_m - reach_m) if arrival > 0.0 else distance_m
        speed = min(cruise, speed_to_stop_m_s(left_m, DECELERATION, JERK, arrival))
        return min(speed, _slowed(missing_rad))

    def _arrival(self, setpoint: Setpoint, cruise_m_s: float) -> tuple[float, float]:
        """How fast at its point, and how near that counts as there: 0 at the last one (AckermannAutoMode)."""
        reach_m = float(self._params["NAV_ACC_RAD"])
        inside = _inside_rad(setpoint)
        if inside is None:
            return 0.0, reach_m
        corner_m = CORNER_GAIN * TURN_RADIUS_M / max(1e-6, math.tan(inside / 2.0))
        return min(cruise_m_s, _slowed(math.pi - inside)), max(reach_m, min(CORNER_MAX_M, corner_m))


def _slowed(turn_rad: float) -> float:
    """For a turn of so much (RO_SPEED_RED 1)."""
    return max(SLOWEST_TURN_M_S, FULL_M_S * (1.0 - min(turn_rad, math.pi) / math.pi))


def _inside_rad(setpoint: Setpoint) -> float | None:
    """The angle at the point between where it comes from and where it goes; None: it stops there."""
    if setpoint.next is None or setpoint.previous is None:
        return None
    back = (setpoint.previous[0] - setpoint.north_m, setpoint.previous[1] - setpoint.east_m)
    on = (setpoint.next[0] - setpoint.north_m, setpoint.next[1] - setpoint.east_m)
    lengths = math.hypot(*back) * math.hypot(*on)
    if lengths < 1e-6:
        return None
    return math.acos(max(-1.0, min(1.0, (back[0] * on[0] + back[1] * on[1]) / lengths)))


def _drag_share(frame: LocalFrame, yaw_rad: float) -> float:
    """Of the squared speed along a heading: each axis of the earth squares its own part."""
    latitude, longitude = math.radians(frame.latitude_deg), math.radians(frame.longitude_deg)
    north, east = math.cos(yaw_rad), math.sin(yaw_rad)
    inward = -math.sin(latitude) * north
    axes = (
        inward * math.cos(longitude) - math.sin(longitude) * east,
        inward * math.sin(longitude) + math.cos(longitude) * east,
        math.cos(latitude) * north,
    )
    return sum(abs(part) ** 3 for part in axes)
