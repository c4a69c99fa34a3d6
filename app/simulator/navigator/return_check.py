"""Said long before a return: that its destination lies too close to the fence (PX4's GeofenceAvoidancePlanner)."""

from __future__ import annotations

import math

from app.simulator.mission.geofence import Geofence
from app.simulator.navigator.context import NavContext
from app.simulator.navigator.fence_planner import avoidance_margin_m
from app.simulator.wire import Mode, Severity

CHECK_S = 2.0
SAME_M = 0.1


class ReturnCheck:
    """Looks every 2 s and says it once for each fence and home [05_fence_rally]; the return flies home all the same."""

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._fence = Geofence((), context.frame)
        self._due_s = 0.0
        self._checked = (0.0, 0.0)

    def take(self, fence: Geofence) -> None:
        """Another fence is in force."""
        self._fence = fence
        self._checked = fence.first_point or (0.0, 0.0)  # where PX4's planner begins; home there is never looked at

    def step(self) -> None:
        """One cycle."""
        context = self._context
        if context.now_s < self._due_s:
            return
        self._due_s = context.now_s + CHECK_S
        home = context.state.status.home
        if home is None or self._fence.first_point is None or context.state.status.mode is Mode.RTL:
            return
        destination = (home.north_m, home.east_m)
        if math.dist(destination, self._checked) < SAME_M:
            return
        self._checked = destination
        if not self._fence.keeps_off(destination, avoidance_margin_m(context)):
            context.text(Severity.WARNING, "RTL destination breaches geofence, will fly directly")
            context.event("rtl_destination_breaches")

    def boot(self) -> None:
        """Power-up."""
        self._due_s = 0.0
