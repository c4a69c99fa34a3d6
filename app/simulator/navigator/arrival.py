"""When does an item count as reached? PX4's is_mission_item_reached_or_completed for items with a position."""

from __future__ import annotations

import math

from app.simulator.navigator.context import NavContext
from app.simulator.navigator.target import Target
from app.simulator.wire import Cmd

MAX_SWITCH_DISTANCE_M = 500.0
ROVER_RADIUS_M = 1.3
"""Rovers steer with their own acceptance radius [13_rover_delivery: 1.3 m before the point]."""
LOITER_REACHED_FACTOR = 1.2
TAKEOFF_TOLERANCE_M = 0.8


class Arrival:
    """Follows one target from activation to completion."""

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._reached_at_s: float | None = None
        self._started_from = (0.0, 0.0)
        self._on_orbit = False

    def start(self) -> None:
        """A new target is active."""
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
        return context.now_s - self._reached_at_s >= self._hold_s(target)

    def switch_radius_m(self, target: Target) -> float:
        """Horizontal distance at which the target counts as reached."""
        context = self._context
        if context.airframe.is_rover:
            return ROVER_RADIUS_M
        if not context.flies_like_plane:
            return target.acceptance_radius_m
        speed = context.state.body.ground_speed_m_s
        switch_m = min(MAX_SWITCH_DISTANCE_M, speed * context.profile.switch_distance_s)
        return max(float(context.params["NAV_ACC_RAD"]), switch_m)

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
        if target.is_takeoff and context.flies_like_plane:
            return body.up_m >= target.up_m - TAKEOFF_TOLERANCE_M
        if target.is_loiter and context.flies_like_plane:
            return self._orbit_reached(target, distance_m)
        near = distance_m <= self.switch_radius_m(target)
        if not near and context.flies_like_plane:
            near = self._passed(target)
        return near and self._altitude_reached(target)

    def _orbit_reached(self, target: Target, distance_m: float) -> bool:
        """A loiter begins when the orbit is reached; LOITER_TO_ALT also wants the altitude."""
        context = self._context
        if distance_m <= target.loiter_radius_m * LOITER_REACHED_FACTOR:
            self._on_orbit = True
        if target.command == Cmd.NAV_LOITER_TO_ALT:
            return self._on_orbit and abs(context.state.body.up_m - target.up_m) <= 5.0
        return self._on_orbit

    def _altitude_reached(self, target: Target) -> bool:
        context = self._context
        if context.airframe.is_rover:
            return True
        name = "NAV_FW_ALT_RAD" if context.flies_like_plane else "NAV_MC_ALT_RAD"
        return abs(context.state.body.up_m - target.up_m) <= float(context.params[name])

    def _passed(self, target: Target) -> bool:
        """Beyond the plane through the waypoint, across the track."""
        body = self._context.state.body
        along = (target.point[0] - self._started_from[0], target.point[1] - self._started_from[1])
        beyond = (body.north_m - target.point[0], body.east_m - target.point[1])
        return along[0] * beyond[0] + along[1] * beyond[1] > 0.0
