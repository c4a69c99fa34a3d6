"""The way round the fence that PX4 plans for a direct return (RTLPlanner/geofence_avoidance_planner.cpp)."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator

from shapely import LineString, Point, Polygon, get_parts, prepare
from shapely.geometry.base import BaseGeometry

from app.simulator.mission.geofence import FenceArea, Geofence
from app.simulator.navigator.context import NavContext

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
