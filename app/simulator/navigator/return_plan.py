"""Where a return goes and how: its altitude, its destination, the way round the fence."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum, auto

from shapely import LineString, Point, Polygon, get_parts, prepare
from shapely.geometry.base import BaseGeometry

from app.simulator.mission.geofence import FenceArea, Geofence
from app.simulator.mission.item import LAND_COMMANDS
from app.simulator.mission.store import MissionStore
from app.simulator.navigator.context import NavContext
from app.simulator.navigator.mission_mode import MissionResult
from app.simulator.wire import Cmd, Mode, Severity

CONE_HALF_ANGLE_RAD = math.radians(45.0)  # RTL_CONE_ANG


def return_up_m(context: NavContext, destination: tuple[float, float], ground_m: float) -> float:
    """PX4's RTL::computeReturnAltitude: never lower than now, less than RTL_RETURN_ALT when `destination` is near."""
    return max(ground_m + _above_ground_m(context, destination), context.state.body.up_m)


def _above_ground_m(context: NavContext, destination: tuple[float, float]) -> float:
    params, body = context.params, context.state.body
    highest_m = float(params["RTL_RETURN_ALT"])
    if context.flies_like_plane:
        return highest_m
    distance_m = math.dist((body.north_m, body.east_m), destination)
    radius_m = float(params["NAV_ACC_RAD"])
    if distance_m <= radius_m:
        return 2.0 * distance_m
    if distance_m <= float(params["RTL_MIN_DIST"]):
        highest_m = min(highest_m, distance_m / math.tan(CONE_HALF_ANGLE_RAD))
    return max(highest_m, 2.0 * radius_m)


# The way round the fence that PX4 plans for a direct return (RTLPlanner/geofence_avoidance_planner.cpp).


Place = tuple[float, float]
CIRCLE_CORNERS = 8
TOUCH_M = 0.05
"""A way may run along an edge that the margin has moved."""


def avoidance_margin_m(context: NavContext) -> float:
    """How far a return keeps off the fence (geofence_avoidance_margin)."""
    airframe, params = context.airframe, context.params
    if airframe.is_fixed_wing or airframe.is_vtol:
        return abs(float(params["NAV_LOITER_RAD"]))
    return 2.0 * float(params["NAV_ACC_RAD"])


class FencePlanner:
    """Over the corners of all areas, moved by the margin: inclusions inwards, exclusions outwards."""

    def __init__(self, fence: Geofence, margin_m: float) -> None:
        moved = [(area.inclusion, _moved(area, margin_m)) for area in fence.areas]
        self._places = tuple(place for _, shape in moved for place in _corners(shape))
        self._areas = [(inclusion, shape.buffer(TOUCH_M if inclusion else -TOUCH_M)) for inclusion, shape in moved]
        for _, shape in self._areas:
            prepare(shape)

    def has(self, place: Place) -> bool:
        """Whether it keeps the margin."""
        return self._allows(Point(place))

    def corners(self, start: Place, end: Place) -> tuple[Place, ...] | None:
        """Between the two; empty for a straight way, None without one. `start` and `end` must keep the margin."""
        if not (self.has(start) and self.has(end)):
            return None
        if start == end:
            return ()
        places = (*self._places, end)
        ahead, came_from, reached = [(0.0, start)], dict[Place, Place](), {start: 0.0}
        while ahead:
            way_m, here = heapq.heappop(ahead)
            if here == end:
                return _between(came_from, start, end)
            if way_m > reached[here]:
                continue
            for there in places:
                there_m = way_m + math.dist(here, there)
                if there_m < reached.get(there, math.inf) and there != here and self._allows(LineString([here, there])):
                    reached[there], came_from[there] = there_m, here
                    heapq.heappush(ahead, (there_m, there))
        return None

    def _allows(self, shape: BaseGeometry) -> bool:
        return all(area.covers(shape) if inclusion else not area.intersects(shape) for inclusion, area in self._areas)


def _moved(area: FenceArea, margin_m: float) -> BaseGeometry:
    out_m = -margin_m if area.inclusion else margin_m
    if area.vertices:
        return Polygon(area.vertices).buffer(out_m, join_style="mitre")
    around = 1.0 if area.inclusion else 1.0 / math.cos(math.pi / CIRCLE_CORNERS)
    radius_m = area.radius_m * around + out_m
    turns = [2.0 * math.pi * n / CIRCLE_CORNERS for n in range(CIRCLE_CORNERS)]
    north_m, east_m = area.centre
    if radius_m <= 0.0:
        return Polygon()
    return Polygon([(north_m + radius_m * math.cos(a), east_m + radius_m * math.sin(a)) for a in turns])


def _corners(shape: BaseGeometry) -> Iterator[Place]:
    for part in get_parts(shape):
        if isinstance(part, Polygon) and not part.is_empty:
            yield from ((north_m, east_m) for north_m, east_m in part.exterior.coords[:-1])


def _between(came_from: dict[Place, Place], start: Place, end: Place) -> tuple[Place, ...]:
    way, here = list[Place](), end
    while (here := came_from[here]) != start:
        way.append(here)
    return tuple(reversed(way))


NorthEast = tuple[float, float]
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
    point: NorthEast


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
    def _home(self) -> NorthEast:
        return self._context.home.north_m, self._context.home.east_m

    def _rally(self, rtl_type: int) -> list[NorthEast]:
        frame = self._context.frame
        points = [frame.to_local(item.latitude_deg, item.longitude_deg) for item in self._store.rally.items]
        return [point for point in points if rtl_type == 5 or math.dist(point, self._home) > AT_HOME_M]

    @property
    def _landing(self) -> list[NorthEast]:
        if self.landing_seq is None:
            return []
        item = self._store.mission.items[self.landing_seq]
        return [self._context.frame.to_local(item.latitude_deg, item.longitude_deg)]


# Said long before a return: that its destination lies too close to the fence (PX4's GeofenceAvoidancePlanner).


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
