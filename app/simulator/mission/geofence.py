"""The fence as the autopilot sees it: points inside inclusions and outside exclusions, distances from home."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import dataclass, replace

from app.simulator.geo import LocalFrame
from app.simulator.mission.item import Item
from app.simulator.wire import MissionAck

POLYGON_INCLUSION = 5001
POLYGON_EXCLUSION = 5002
CIRCLE_INCLUSION = 5003
CIRCLE_EXCLUSION = 5004
STORED_FRAME = 5


def fence_refusal(item: Item) -> MissionAck:
    """A polygon of less than 3 vertices is an error; a wrong number of items is not noticed [05_fence_rally]."""
    if item.command in (POLYGON_INCLUSION, POLYGON_EXCLUSION) and item.param1 < 3:
        return MissionAck.ERROR
    return MissionAck.ACCEPTED


def stored_fence_item(item: Item) -> Item:
    """A fence is stored without frame and autocontinue: a download shows GLOBAL_INT and 0."""
    return replace(item, frame=STORED_FRAME, autocontinue=0, param2=0.0, param3=0.0, param4=0.0, z=0.0)


Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class FenceArea:
    """A polygon with `vertices`, or a circle without; north and east of the frame's origin."""

    inclusion: bool
    vertices: tuple[Point, ...] = ()
    centre: Point = (0.0, 0.0)
    radius_m: float = 0.0
    complete: bool = True

    def contains(self, point: Point) -> bool:
        if not self.complete:
            return False
        if not self.vertices:
            return math.dist(point, self.centre) < self.radius_m
        inside = False
        previous = self.vertices[-1]
        for vertex in self.vertices:
            if (vertex[1] >= point[1]) != (previous[1] >= point[1]):
                slope = (previous[0] - vertex[0]) / (previous[1] - vertex[1])
                if point[0] <= slope * (point[1] - vertex[1]) + vertex[0]:
                    inside = not inside
            previous = vertex
        return inside

    def border_m(self, point: Point) -> float:
        """Distance to the border, on whichever side."""
        if not self.vertices:
            return abs(math.dist(point, self.centre) - self.radius_m)
        return min(
            _to_edge_m(point, a, b) for a, b in zip(self.vertices, (*self.vertices[1:], self.vertices[0]), strict=True)
        )


class Geofence:
    """Built from the stored fence items; a polygon with missing vertices contains nothing [05_fence_rally]."""

    def __init__(self, items: tuple[Item, ...], frame: LocalFrame, *, needs_all: bool = False) -> None:
        """`needs_all`: a point has to be in every inclusion, not in any (since v1.15)."""
        self._needs_all = needs_all
        self._areas: list[FenceArea] = []
        index = 0
        while index < len(items):
            item = items[index]
            if item.command in (POLYGON_INCLUSION, POLYGON_EXCLUSION):
                count = int(item.param1)
                points = [frame.to_local(i.latitude_deg, i.longitude_deg) for i in items[index : index + count]]
                inclusion = item.command == POLYGON_INCLUSION
                self._areas.append(FenceArea(inclusion, tuple(points), complete=len(points) == count))
                index += count
                continue
            if item.command in (CIRCLE_INCLUSION, CIRCLE_EXCLUSION):
                centre = frame.to_local(item.latitude_deg, item.longitude_deg)
                inclusion = item.command == CIRCLE_INCLUSION
                self._areas.append(FenceArea(inclusion, centre=centre, radius_m=item.param1))
            index += 1

    @property
    def empty(self) -> bool:
        """No usable area."""
        return not self._areas

    @property
    def areas(self) -> tuple[FenceArea, ...]:
        return tuple(self._areas)

    @property
    def first_point(self) -> Point | None:
        """First vertex or centre; None without a fence, and with one that has a polygon of missing vertices."""
        if not self._areas or not all(area.complete for area in self._areas):
            return None
        return self._areas[0].vertices[0] if self._areas[0].vertices else self._areas[0].centre

    def keeps_off(self, point: Point, margin_m: float) -> bool:
        """Inside every inclusion, outside every exclusion, and that far from all borders."""
        return all(area.contains(point) == area.inclusion and area.border_m(point) >= margin_m for area in self._areas)

    def allows(self, point: Point) -> bool:
        """In an inclusion, or in all, if there are any, and in no exclusion."""
        inclusions = [area.contains(point) for area in self._areas if area.inclusion]
        inside = all(inclusions) if self._needs_all else any(inclusions) or not inclusions
        return inside and not any(area.contains(point) for area in self._areas if not area.inclusion)

    def valid_at(self, point: Point) -> Geofence:
        """What is left of it for a vehicle there: all or nothing, since v1.15 area by area."""
        valid = copy(self)
        if self._needs_all:
            valid._areas = [area for area in self._areas if area.contains(point) == area.inclusion]
        elif not self.allows(point):
            valid._areas = []
        return valid


def _to_edge_m(point: Point, start: Point, end: Point) -> float:
    along = (end[0] - start[0], end[1] - start[1])
    squared = along[0] ** 2 + along[1] ** 2
    share = 0.0
    if squared > 0.0:
        share = ((point[0] - start[0]) * along[0] + (point[1] - start[1]) * along[1]) / squared
        share = max(0.0, min(1.0, share))
    return math.dist(point, (start[0] + share * along[0], start[1] + share * along[1]))
