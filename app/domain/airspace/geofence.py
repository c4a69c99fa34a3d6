"""The geofence as areas in local metres, and the geofence on board a vehicle. Paths around it: fence_route.py."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from app.domain.airspace import shapes
from app.domain.geo import LocalProjection
from app.domain.items.fields import Point as Corner
from app.domain.mission import MavCmd, MissionItem
from app.domain.plan.document import FenceCircle, FenceKind, FencePolygon, Geofence

Place = tuple[float, float]
"""East, north."""

_SEGMENTS = 32
"""Segments per quarter circle. The polygon is inside an inclusion circle and around an exclusion circle, to be safe."""
_ROUTE_SEGMENTS = 2
"""PX4's planner of returns flies around an exclusion circle along 8 corners outside of it."""
MIN_AREA_M2 = 1.0
_BEND_M: Final = 0.25
"""How far a part of a polygon's edge may be beside it. An edge of 3 km at 60 degrees of latitude bends so much."""
_MOST_PARTS: Final = 64
_TOUCH_M: Final = 0.05
_MARGIN_M: Final = 100_000.0
"""Wider than any exclusion: all around a way is allowed if there are exclusions only."""
_ROUNDING: Final = 1.01
"""A widened shape has corners instead of arcs, which lie a little inside."""


@dataclass(frozen=True, slots=True)
class FenceArea:
    """`inside` is the area that inclusions allow, None without any; `outside` is the union of the exclusions.

    `avoided` contains `outside`: a return flies around it. Its circles have few corners.
    """

    inside: shapes.BaseGeometry | None
    outside: shapes.BaseGeometry | None
    avoided: shapes.BaseGeometry | None = None

    def allows(self, path: shapes.BaseGeometry) -> bool:
        """Whether the whole path is inside the inclusions and outside the exclusions."""
        if self.inside is not None and not self.inside.covers(path):
            return False
        return self.outside is None or not self.outside.intersects(path)

    def leads_back(self, start: Place, end: Place) -> bool:
        """Whether the straight way from a start outside leads back: once inside it stays there, and before it is never
        farther outside than the start. It may end outside if it ends nearer.
        """
        if self.allows(shapes.Point(start)):
            return False
        way = shapes.LineString((start, end))
        free = way.buffer(_MARGIN_M) if self.inside is None else self.inside
        if self.outside is not None:
            free = free.difference(self.outside)
        beyond, out_m, end_m = (
            way.difference(free),
            free.distance(shapes.Point(start)),
            free.distance(shapes.Point(end)),
        )
        if not isinstance(beyond, shapes.LineString) or not (end_m == 0.0 or end_m < out_m):
            return False
        return bool(free.buffer(out_m * _ROUNDING + _TOUCH_M).covers(beyond))

    def clearance_m(self, path: shapes.BaseGeometry) -> float:
        """Return the distance of the path from the edge of the allowed area; infinite without a geofence."""
        clearance_m = math.inf if self.inside is None else float(self.inside.boundary.distance(path))
        return clearance_m if self.outside is None else min(clearance_m, float(self.outside.distance(path)))


def fence_area(fence: Geofence, projection: LocalProjection, *, all_of_home: bool = False) -> FenceArea:
    """Return the area of all valid polygons and circles. A polygon that intersects itself has no area and is omitted.

    `all_of_home`: a position must be in all inclusions that contain home, the origin of the projection.
    """
    parts: dict[str, list[shapes.BaseGeometry]] = {"inclusion": [], "exclusion": []}
    for polygon in fence.polygons:
        shape = polygon_shape(polygon, projection)
        if is_simple_polygon(shape):
            parts[polygon.kind].append(shape)
    avoided = list(parts["exclusion"])
    for circle in fence.circles:
        parts[circle.kind].append(_circle_shape(circle, projection, _SEGMENTS))
        if circle.kind == "exclusion":
            avoided.append(_circle_shape(circle, projection, _ROUTE_SEGMENTS))
    inside = _inside(parts["inclusion"], all_of_home=all_of_home)
    return FenceArea(inside, _union(parts["exclusion"]), _union(avoided))


def polygon_shape(polygon: FencePolygon, projection: LocalProjection) -> shapes.Polygon:
    """Return the polygon in local metres. Its edges are straight in latitude and longitude, as for the autopilot.

    Across the antimeridian, where a rule rejects it, they are straight on the ground.
    """
    if crosses_antimeridian(polygon):
        return shapes.Polygon([projection.to_local(one.latitude_deg, one.longitude_deg) for one in polygon.vertices])
    return shapes.Polygon([place for one, other in _edges(polygon) for place in _edge(one, other, projection)])


def crosses_antimeridian(polygon: FencePolygon) -> bool:
    """Whether an edge takes the short way across it. The autopilot, which compares longitudes, takes the long way."""
    return any(abs(other.longitude_deg - one.longitude_deg) > 180.0 for one, other in _edges(polygon))


def _edges(polygon: FencePolygon) -> Iterator[tuple[Corner, Corner]]:
    return pairwise((*polygon.vertices, polygon.vertices[0]))


def _edge(one: Corner, other: Corner, projection: LocalProjection) -> Iterator[Place]:
    """The first corner, and the places between that it takes to follow a long edge."""
    start = projection.to_local(one.latitude_deg, one.longitude_deg)
    yield start
    end = projection.to_local(other.latitude_deg, other.longitude_deg)
    north_deg, east_deg = other.latitude_deg - one.latitude_deg, other.longitude_deg - one.longitude_deg
    middle = projection.to_local(one.latitude_deg + north_deg / 2, one.longitude_deg + east_deg / 2)
    bend_m = math.dist(middle, ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2))
    parts = min(_MOST_PARTS, math.ceil(math.sqrt(bend_m / _BEND_M)))
    for part in range(1, parts):
        share = part / parts
        yield projection.to_local(one.latitude_deg + share * north_deg, one.longitude_deg + share * east_deg)


def is_simple_polygon(shape: shapes.Polygon) -> bool:
    """Whether it has an area and does not intersect itself."""
    return bool(shape.is_valid) and shape.area >= MIN_AREA_M2


def _circle_shape(circle: FenceCircle, projection: LocalProjection, segments: int) -> shapes.Polygon:
    centre = shapes.Point(projection.to_local(circle.latitude_deg, circle.longitude_deg))
    widen = 1.0 if circle.kind == "inclusion" else 1.0 / math.cos(math.pi / (4 * segments))
    return centre.buffer(circle.radius_m * widen, quad_segs=segments)


def _inside(areas: list[shapes.BaseGeometry], *, all_of_home: bool) -> shapes.BaseGeometry | None:
    of_home = [area for area in areas if area.covers(shapes.Point(0.0, 0.0))]
    if not all_of_home or len(of_home) == 0:
        return _union(areas)
    inside = shapes.intersection_all(of_home).buffer(0.0)  # drop lines and points where two polygons only touch
    shapes.prepare(inside)
    return inside


def _union(areas: list[shapes.BaseGeometry]) -> shapes.BaseGeometry | None:
    if not areas:
        return None
    union = shapes.union_all(areas)
    shapes.prepare(union)
    return union


_VERTICES: dict[MavCmd, FenceKind] = {
    MavCmd.NAV_FENCE_POLYGON_VERTEX_INCLUSION: "inclusion",
    MavCmd.NAV_FENCE_POLYGON_VERTEX_EXCLUSION: "exclusion",
}
_CIRCLES: dict[MavCmd, FenceKind] = {
    MavCmd.NAV_FENCE_CIRCLE_INCLUSION: "inclusion",
    MavCmd.NAV_FENCE_CIRCLE_EXCLUSION: "exclusion",
}


def onboard_fence(
    items: Sequence[MissionItem], projection: LocalProjection, *, needs_all_inclusions: bool
) -> FenceArea | None:
    """Return the area of a downloaded geofence list; None if it is empty. param1 of a corner is the number of corners.

    The origin of the projection is home. A position must be in any inclusion, or in all those that contain home.
    """
    polygons: list[FencePolygon] = []
    circles: list[FenceCircle] = []
    corners: list[Corner] = []
    for item in items:
        place = Corner(latitude_deg=item.x / 1e7, longitude_deg=item.y / 1e7)
        if item.command in _VERTICES:
            corners.append(place)
            if len(corners) >= max(3, int(item.param1)):
                polygons.append(FencePolygon(kind=_VERTICES[item.command], vertices=tuple(corners)))
                corners = []
        elif item.command in _CIRCLES:
            circle = FenceCircle(kind=_CIRCLES[item.command], radius_m=item.param1, **place.model_dump())
            circles.append(circle)
    if not polygons and not circles:
        return None
    fence = Geofence(polygons=tuple(polygons), circles=tuple(circles))
    return fence_area(fence, projection, all_of_home=needs_all_inclusions)
