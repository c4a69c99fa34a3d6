"""Where a return goes, and on which way: home, a rally point, the mission's landing, or along the mission."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, auto

from app.simulator.mission.item import LAND_COMMANDS
from app.simulator.mission.store import MissionStore
from app.simulator.navigator.context import NavContext
from app.simulator.navigator.mission_mode import MissionResult
from app.simulator.wire import Cmd

Point = tuple[float, float]
NEARER_M = 2.0
"""Another place has to be nearer by this much."""
AT_HOME_M = 10.0
"""A rally point this near to home is none."""


class Way(Enum):
    """How a return flies."""

    DIRECT = auto()
    TO_LANDING = auto()
    """Direct to where the mission's landing begins, and then as the mission lands."""
    FORWARD = auto()
    """The mission's path to its landing."""
    REVERSE = auto()
    """The mission's path back to where it began, and home."""


@dataclass(frozen=True, slots=True)
class ReturnPlan:
    """`point` is north and east of the destination; home for a way along the mission."""

    way: Way
    point: Point


class ReturnDestination:
    """PX4's RTL::setRtlTypeAndDestination. The first LAND item is the mission's landing, wherever it is."""

    def __init__(self, context: NavContext, store: MissionStore, result: MissionResult) -> None:
        self._context = context
        self._store = store
        self._result = result

    def choose(self) -> ReturnPlan:
        """By RTL_TYPE and what is stored now."""
        rtl_type = self._context.params.integer("RTL_TYPE")
        if rtl_type not in (2, 4):
            return self._closest(rtl_type)
        if not self._result.valid:
            return ReturnPlan(Way.DIRECT, self._home)
        start, done = self.landing_start, self._store.current_seq
        forward = start is not None and (rtl_type == 2 or start - done < done)
        return ReturnPlan(Way.FORWARD if forward else Way.REVERSE, self._home)

    @property
    def landing_seq(self) -> int | None:
        """The mission's landing; None when it has none or cannot be flown."""
        items = self._store.mission.items if self._result.valid else ()
        return next((seq for seq, item in enumerate(items) if item.command in LAND_COMMANDS), None)

    @property
    def landing_start(self) -> int | None:
        """Where it begins: DO_LAND_START, else the LAND itself."""
        items = self._store.mission.items
        starts = (seq for seq, item in enumerate(items) if item.command == Cmd.DO_LAND_START)
        return None if self.landing_seq is None else next(starts, self.landing_seq)

    def _closest(self, rtl_type: int) -> ReturnPlan:
        """Home first, then the landing, then rally points: what comes later has to be clearly nearer."""
        context, body = self._context, self._context.state.body
        here, best = (body.north_m, body.east_m), ReturnPlan(Way.DIRECT, self._home)
        hovering_vtol = context.airframe.is_vtol and context.hovers
        home_counts = rtl_type != 5 and (rtl_type != 1 or hovering_vtol)
        nearest_m = math.dist(here, self._home) if home_counts else math.inf
        places = [ReturnPlan(Way.TO_LANDING, point) for point in self._landing] if rtl_type in (1, 3) else []
        places += [ReturnPlan(Way.DIRECT, point) for point in self._rally(rtl_type)]
        if rtl_type == 5 and not places:
            return ReturnPlan(Way.DIRECT, here)
        for place in places:
            distance_m = math.dist(here, place.point)
            if distance_m + NEARER_M < nearest_m:
                nearest_m, best = distance_m, place
        return best

    @property
    def _home(self) -> Point:
        return self._context.home.north_m, self._context.home.east_m

    def _rally(self, rtl_type: int) -> list[Point]:
        frame = self._context.frame
        points = [frame.to_local(item.latitude_deg, item.longitude_deg) for item in self._store.rally.items]
        return [point for point in points if rtl_type == 5 or math.dist(point, self._home) > AT_HOME_M]

    @property
    def _landing(self) -> list[Point]:
        if self.landing_seq is None:
            return []
        item = self._store.mission.items[self.landing_seq]
        return [self._context.frame.to_local(item.latitude_deg, item.longitude_deg)]
