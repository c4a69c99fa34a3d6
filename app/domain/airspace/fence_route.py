"""The way of a direct return around the geofence, in local metres. The search is bounded, whatever the geofence."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Sequence
from enum import Enum, auto
from functools import cached_property
from itertools import pairwise
from typing import Final

from app.domain.airspace import shapes
from app.domain.airspace.geofence import FenceArea, Place

MOST_CORNERS: Final = 1024
"""A vehicle stores 64 corners and circles; a circle has 8 corners here."""
MOST_LEGS: Final = 5_000
"""Legs that are compared with the geofence, for all ways of one FenceRoutes: half a second."""
MOST_LOOKS: Final = 250_000
"""Looks from one corner to another, likewise."""

_COARSE_M: Final = 1.0
"""Simplifies edges of many corners. The margin is several times larger than the error."""
_TOUCH_M: Final = 0.05
"""A way may run along an edge that the margin has moved."""
_LEVEL_M2: Final = 1e-3
"""A leg along an edge, but for rounding."""

Way = tuple[Place, ...]
"""Corners, with both ends."""


class NoWay(Enum):
    """Why there is no way."""

    BLOCKED = auto()
    UNKNOWN = auto()
    """The geofence is too intricate to search."""


def length_m(way: Sequence[Place]) -> float:
    """Return the path along its corners."""
    return sum(math.dist(a, b) for a, b in pairwise(way))


class FenceRoutes:
    """Ways around one geofence, each searched once. All of them share one bound of work."""

    def __init__(self, area: FenceArea, margin_m: float) -> None:
        self._area = area
        self._margin_m = margin_m
        self._known: dict[tuple[Place, Place], Way | NoWay] = {}
        self._budget = _Budget(MOST_LEGS, MOST_LOOKS)

    def way(self, here: Place, there: Place) -> Way | NoWay:
        """The corners of the shortest path from `here` to `there`.

        A start closer to the geofence than the margin first leaves it by the shortest way. A destination there has no
        path.
        """
        ends = (here, there)
        if ends not in self._known:
            self._known[ends] = self._find(here, there)
        return self._known[ends]

    @cached_property
    def _free(self) -> _Free:
        return _Free(self._area, self._margin_m)

    def _find(self, here: Place, there: Place) -> Way | NoWay:
        free = self._free
        if free.sees(here, there):
            return (here, there)
        start = here if free.has(here) else free.nearest(here)
        if start is None or not free.has(there) or not self._area.allows(_leg(here, start)):
            return NoWay.BLOCKED
        if not free.joins(start, there):
            return NoWay.BLOCKED
        found = free.way(start, there, self._budget)
        return found if isinstance(found, NoWay) or start == here else (here, *found)


class _Budget:
    """Work that is left."""

    def __init__(self, legs: int, looks: int) -> None:
        self._legs = legs
        self._looks = looks

    def takes(self, *, legs: int = 0, looks: int = 0) -> bool:
        """Whether it is enough for this, too."""
        self._legs -= legs
        self._looks -= looks
        return self._legs >= 0 and self._looks >= 0


class _Free:
    """The allowed area with a margin to its edges."""

    def __init__(self, area: FenceArea, margin_m: float) -> None:
        self._inside = _moved(area.inside, -margin_m)
        self._outside = _moved(area.outside if area.avoided is None else area.avoided, margin_m)
        turns = (*_turns(self._inside, is_obstacle=False), *_turns(self._outside, is_obstacle=True))
        self._beside = {corner: beside for corner, *beside in turns}
        self._inclusion = None if self._inside is None else self._inside.buffer(_TOUCH_M)
        self._exclusion = None if self._outside is None else self._outside.buffer(-_TOUCH_M)
        for shape in (self._inclusion, self._exclusion):
            if shape is not None:
                shapes.prepare(shape)

    def has(self, place: Place) -> bool:
        return self._allows(shapes.Point(place))

    def sees(self, here: Place, there: Place) -> bool:
        return self._allows(_leg(here, there))

    def nearest(self, place: Place) -> Place | None:
        """Return the nearest position with the margin."""
        edges = [one for one in (self._inside, None if self._outside is None else self._outside.boundary) if one]
        found = [shapes.nearest_points(edge, shapes.Point(place))[0] for edge in edges if not edge.is_empty]
        places = [(point.x, point.y) for point in found if self.has((point.x, point.y))]
        return min(places, key=lambda one: math.dist(one, place), default=None)

    def joins(self, start: Place, end: Place) -> bool:
        """Whether one part of the area has both, so that no search is needed to find that there is no way."""
        ends = [shapes.Point(start), shapes.Point(end)]
        within: shapes.BaseGeometry | None = self._inclusion
        if within is None:
            within = shapes.union_all([*ends, *(() if self._exclusion is None else (self._exclusion,))]).envelope
            within = within.buffer(10.0 * _TOUCH_M)
        free = within if self._exclusion is None else within.difference(self._exclusion)
        return any(all(part.distance(one) <= _TOUCH_M for one in ends) for part in shapes.get_parts(free))

    def way(self, start: Place, end: Place, budget: _Budget) -> Way | NoWay:
        """A* over the corners. A leg is compared with the geofence only once it may be part of the shortest way."""
        if len(self._beside) > MOST_CORNERS:
            return NoWay.UNKNOWN
        before: dict[Place, Place] = {}
        ahead = [(math.dist(start, end), 0.0, start, start)]
        while ahead:
            _, way_m, here, origin = heapq.heappop(ahead)
            if here in before:
                continue
            if not budget.takes(legs=1):
                return NoWay.UNKNOWN
            if here != start and not self.sees(origin, here):
                continue
            before[here] = origin
            if here == end:
                return _back(before, start, end)
            if not budget.takes(looks=len(self._beside)):
                return NoWay.UNKNOWN
            for there in (*self._beside, end):
                if there not in before and self._touches(here, there) and self._touches(there, here):
                    there_m = way_m + math.dist(here, there)
                    heapq.heappush(ahead, (there_m + math.dist(there, end), there_m, there, here))
        return NoWay.BLOCKED

    def _touches(self, corner: Place, other: Place) -> bool:
        """Whether a leg to the corner passes beside its two edges, as every leg of a shortest way does."""
        (x, y), (to_x, to_y) = corner, (other[0] - corner[0], other[1] - corner[1])
        sides = [to_x * (beside_y - y) - to_y * (beside_x - x) for beside_x, beside_y in self._beside.get(corner, ())]
        return not sides or min(sides) >= -_LEVEL_M2 or max(sides) <= _LEVEL_M2

    def _allows(self, shape: shapes.BaseGeometry) -> bool:
        if self._inclusion is not None and not self._inclusion.covers(shape):
            return False
        return self._exclusion is None or not self._exclusion.intersects(shape)


def _moved(shape: shapes.BaseGeometry | None, by_m: float) -> shapes.BaseGeometry | None:
    return None if shape is None else shape.buffer(by_m, join_style="mitre").simplify(_COARSE_M)


def _turns(shape: shapes.BaseGeometry | None, *, is_obstacle: bool) -> Iterator[tuple[Place, Place, Place]]:
    """The corners that stick out into the free area, each with those before and after it. No way bends at others."""
    for part in () if shape is None else shapes.get_parts(shape):
        if isinstance(part, shapes.Polygon) and not part.is_empty:
            left = shapes.orient(part)
            for ring in (left.exterior, *left.interiors):
                corners = [(x, y) for x, y in ring.coords][:-1]
                for index, (x, y) in enumerate(corners):
                    (x0, y0), (x1, y1) = corners[index - 1], corners[(index + 1) % len(corners)]
                    turn = (x - x0) * (y1 - y) - (y - y0) * (x1 - x)
                    if (turn > 0) is is_obstacle and turn != 0:
                        yield (x, y), (x0, y0), (x1, y1)


def _back(before: dict[Place, Place], start: Place, end: Place) -> Way:
    way = [end]
    while way[-1] != start:
        way.append(before[way[-1]])
    return tuple(reversed(way))


def _leg(here: Place, there: Place) -> shapes.BaseGeometry:
    return shapes.Point(here) if here == there else shapes.LineString([here, there])
