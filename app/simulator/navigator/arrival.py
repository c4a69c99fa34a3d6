"""When does an item count as reached? PX4's is_mission_item_reached_or_completed for items with a position."""

from __future__ import annotations

import math

from app.simulator.geo import wrap_pi
from app.simulator.navigator.context import NavContext
from app.simulator.navigator.target import Target
from app.simulator.wire import Cmd

MAX_SWITCH_DISTANCE_M = 500.0
ROVER_CORNER_M = 1.284
"""Wheel base over the sine of the steering limit, times RA_ACC_RAD_GAIN."""
ROVER_CORNER_MAX_M = 3.0  # RA_ACC_RAD_MAX
EXIT_COURSE_RAD = math.radians(5.0)
"""A loiter that asks for it is left when the vehicle flies towards the next point."""
TOO_NEAR_TO_FACE = 1.05
"""Of the radius: a next point that is nearer may never be ahead."""
TAKEOFF_TOLERANCE_M = 0.8


class Arrival:
    """Follows one target from activation to completion."""

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._reached_at_s: float | None = None
        self._started_from = (0.0, 0.0)
        self._on_orbit = False

    def start(self) -> None:
        body = self._context.state.body
        self._reached_at_s = None
        self._on_orbit = False
        self._started_from = (body.north_m, body.east_m)

    def completed(self, target: Target) -> bool:
        """Position reached and, where it counts, the hold time over."""
        context = self._context
        if target.is_landing:
            return context.state.status.landed
        if self._reached_at_s is None:
            if not self._position_reached(target):
                return False
            self._reached_at_s = context.now_s
        if context.now_s - self._reached_at_s < self._hold_s(target):
            return False
        circles = target.leave_towards_next and context.flies_like_plane
        return not circles or self._faces_next(target)

    def switch_radius_m(self, target: Target) -> float:
        """Horizontal distance at which the target counts as reached."""
        context = self._context
        default_m = float(context.params["NAV_ACC_RAD"])
        if context.airframe.is_rover:
            return self._corner_radius_m(target, default_m)
        if context.hovers:
            return target.acceptance_radius_m
        if not context.flies_like_plane:
            return default_m
        speed = context.state.body.ground_speed_m_s
        return max(default_m, min(MAX_SWITCH_DISTANCE_M, speed * context.profile.switch_distance_s(context.params)))

    def _corner_radius_m(self, target: Target, default_m: float) -> float:
        """A rover turns in early, so that it cuts the corner tangentially; none at its last point."""
        following = self._context.setpoint.next
        if following is None:
            return default_m
        back = (self._started_from[0] - target.point[0], self._started_from[1] - target.point[1])
        on = (following[0] - target.point[0], following[1] - target.point[1])
        angle = abs(wrap_pi(math.atan2(back[1], back[0]) - math.atan2(on[1], on[0])))
        if angle < 1e-3:
            return ROVER_CORNER_MAX_M
        return max(default_m, min(ROVER_CORNER_MAX_M, ROVER_CORNER_M / math.tan(angle / 2.0)))

    def _hold_s(self, target: Target) -> float:
        """A WAYPOINT's hold counts in rotary-wing state only."""
        if target.command == Cmd.NAV_LOITER_UNLIM:
            return math.inf
        if target.command == Cmd.NAV_WAYPOINT and not self._context.hovers:
            return 0.0
        return target.hold_s

    def _position_reached(self, target: Target) -> bool:
        context = self._context
        body = context.state.body
        distance_m = math.dist((body.north_m, body.east_m), target.point)
        if target.is_takeoff and not (context.hovers or context.airframe.is_vtol):
            return body.up_m >= target.up_m - TAKEOFF_TOLERANCE_M
        if target.is_loiter and context.flies_like_plane:
            return self._orbit_reached(target, distance_m)
        near = distance_m <= self.switch_radius_m(target)
        if not near and context.flies_like_plane:
            near = self._passed(target)
        return near and self._altitude_reached(target)

    def _orbit_reached(self, target: Target, distance_m: float) -> bool:
        """A loiter begins when the orbit is reached; LOITER_TO_ALT comes down only then, and wants the altitude."""
        context = self._context
        if not self._on_orbit and distance_m <= target.loiter_radius_m + self.switch_radius_m(target):
            self._on_orbit = True
            context.setpoint.up_m = target.up_m
        if not self._on_orbit:
            return False
        return target.command != Cmd.NAV_LOITER_TO_ALT or self._altitude_reached(target)

    def _faces_next(self, target: Target) -> bool:
        following = self._context.setpoint.next
        if following is None or math.dist(following, target.point) <= TOO_NEAR_TO_FACE * target.loiter_radius_m:
            return True
        body = self._context.state.body
        bearing = math.atan2(following[1] - body.east_m, following[0] - body.north_m)
        course = math.atan2(body.v_east_m_s, body.v_north_m_s)
        return abs(wrap_pi(bearing - course)) <= EXIT_COURSE_RAD

    def _altitude_reached(self, target: Target) -> bool:
        context = self._context
        if context.airframe.is_rover:
            return True
        name = "NAV_MC_ALT_RAD"
        if context.flies_like_plane:  # a VTOL lands as a multicopter (NAV_FORCE_VT)
            approaches = context.setpoint.next_lands and not context.airframe.is_vtol
            name = "NAV_FW_ALTL_RAD" if approaches else "NAV_FW_ALT_RAD"
        return abs(context.state.body.up_m - target.up_m) <= float(context.params[name])

    def _passed(self, target: Target) -> bool:
        """Beyond the plane through the waypoint, across the track."""
        body = self._context.state.body
        along = (target.point[0] - self._started_from[0], target.point[1] - self._started_from[1])
        beyond = (body.north_m - target.point[0], body.east_m - target.point[1])
        return along[0] * beyond[0] + along[1] * beyond[1] > 0.0
