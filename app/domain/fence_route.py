"""The way of a direct return round a fence, as PX4 plans it: the shortest over the fence's corners, off by a margin."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Final

from shapely import LineString, Point, Polygon, get_parts, prepare
from shapely.geometry.base import BaseGeometry
from shapely.ops import nearest_points

from app.domain.fence_area import FenceArea

Place = tuple[float, float]

_COARSE_M: Final = 1.0
"""A circle needs no more corners than this; the margin is several times as wide."""
_TOUCH_M: Final = 0.05


def way_round(area: FenceArea, here: Place, there: Place, margin_m: float) -> tuple[Place, ...] | None:
    """The corners of the shortest way from `here` to `there`, both included, in local metres; None: there is none.

    A start nearer to the fence than the margin leaves it the shortest way first; a destination there has no way.
    """
    free = _Free(area, margin_m)
    if free.sees(here, there):
        return (here, there)
    start = here if free.has(here) else free.nearest(here)
    if start is None or not free.has(there) or not area.allows(_leg(here, start)):
        return None
    corners = free.way(start, there)
    return None if corners is None else (here, *corners) if start != here else corners


def length_m(way: tuple[Place, ...]) -> float:
    """Along its corners."""
    return sum(math.dist(a, b) for a, b in pairwise(way))


class _Free:
    """What is left of the area with a margin to all of its edges."""

    def __init__(self, area: FenceArea, margin_m: float) -> None:
        self._inside, self._outside = _moved(area.inside, -margin_m), _moved(area.outside, margin_m)
        self._corners = tuple({corner for shape in (self._inside, self._outside) for corner in _corners(shape)})
        self._room = None if self._inside is None else self._inside.buffer(_TOUCH_M)
        self._walls = None if self._outside is None else self._outside.buffer(-_TOUCH_M)
        for shape in (self._room, self._walls):
            if shape is not None:
                prepare(shape)

    def has(self, place: Place) -> bool:
        return self._allows(Point(place))

    def sees(self, here: Place, there: Place) -> bool:
        return self._allows(_leg(here, there))

    def nearest(self, place: Place) -> Place | None:
        """The nearest place that keeps the margin."""
        shapes = [one for one in (self._inside, None if self._outside is None else self._outside.boundary) if one]
        found = [nearest_points(shape, Point(place))[0] for shape in shapes if not shape.is_empty]
        places = [(point.x, point.y) for point in found if self.has((point.x, point.y))]
        return min(places, key=lambda one: math.dist(one, place), default=None)

    def way(self, start: Place, end: Place) -> tuple[Place, ...] | None:
        """Dijkstra over what is seen from corner to corner."""
        places = (*self._corners, end)
        ahead, before, reached = [(0.0, start)], dict[Place, Place](), {start: 0.0}
        done = set[Place]()
        while ahead:
            way_m, here = heapq.heappop(ahead)
            if here == end:
                return _back(before, start, end)
            if here in done:
                continue
            done.add(here)
            for there in places:
                there_m = way_m + math.dist(here, there)
                if there not in done and there_m < reached.get(there, math.inf) and self.sees(here, there):
                    reached[there], before[there] = there_m, here
                    heapq.heappush(ahead, (there_m, there))
        return None

    def _allows(self, shape: BaseGeometry) -> bool:
        if self._room is not None and not self._room.covers(shape):
            return False
        return self._walls is None or not self._walls.intersects(shape)


def _moved(shape: BaseGeometry | None, by_m: float) -> BaseGeometry | None:
    return None if shape is None else shape.buffer(by_m, join_style="mitre").simplify(_COARSE_M)


def _corners(shape: BaseGeometry | None) -> Iterator[Place]:
    for part in () if shape is None else get_parts(shape):
        if isinstance(part, Polygon):
            for ring in (part.exterior, *part.interiors):
                yield from ((x, y) for x, y in ring.coords)


def _back(before: dict[Place, Place], start: Place, end: Place) -> tuple[Place, ...]:
    way = [end]
    while way[-1] != start:
        way.append(before[way[-1]])
    return tuple(reversed(way))


def _leg(here: Place, there: Place) -> BaseGeometry:
    return Point(here) if here == there else LineString([here, there])
