"""The fence as areas in local metres."""

from __future__ import annotations

import math
from dataclasses import dataclass

from shapely import Point, Polygon, intersection_all, prepare, union_all
from shapely.geometry.base import BaseGeometry

from app.domain.geo import LocalProjection
from app.domain.plan.geofence import FenceCircle, FencePolygon, Geofence

_SEGMENTS = 32
"""Of a quarter circle. An inclusion is drawn inside its circle, an exclusion around it: both err to the safe side."""
MIN_AREA_M2 = 1.0


@dataclass(frozen=True, slots=True)
class FenceArea:
    """`inside` is where the inclusions allow it, None if there are none; `outside` the union of the exclusions."""

    inside: BaseGeometry | None
    outside: BaseGeometry | None

    def allows(self, path: BaseGeometry) -> bool:
        """The whole path lies where the inclusions allow it, and nothing of it in an exclusion."""
        if self.inside is not None and not self.inside.covers(path):
            return False
        return self.outside is None or not self.outside.intersects(path)

    def room_m(self, path: BaseGeometry) -> float:
        """How near the path comes to the edge of what is allowed; infinite without a fence."""
        room_m = math.inf if self.inside is None else float(self.inside.boundary.distance(path))
        return room_m if self.outside is None else min(room_m, float(self.outside.distance(path)))


def fence_area(fence: Geofence, projection: LocalProjection, *, all_of_home: bool = False) -> FenceArea:
    """The area of all usable polygons and circles; a polygon that crosses itself has no area and is left out.

    `all_of_home`: what is allowed lies in all inclusions that contain home, the origin of the projection.
    """
    parts: dict[str, list[BaseGeometry]] = {"inclusion": [], "exclusion": []}
    for polygon in fence.polygons:
        shape = polygon_shape(polygon, projection)
        if is_simple_polygon(shape):
            parts[polygon.kind].append(shape)
    for circle in fence.circles:
        parts[circle.kind].append(_circle_shape(circle, projection))
    return FenceArea(_inside(parts["inclusion"], all_of_home=all_of_home), _union(parts["exclusion"]))


def polygon_shape(polygon: FencePolygon, projection: LocalProjection) -> Polygon:
    """The polygon in local metres."""
    return Polygon([projection.to_local(vertex.latitude_deg, vertex.longitude_deg) for vertex in polygon.vertices])


def is_simple_polygon(shape: Polygon) -> bool:
    """It does not cross or touch itself and has an area."""
    return bool(shape.is_valid) and shape.area >= MIN_AREA_M2


def _circle_shape(circle: FenceCircle, projection: LocalProjection) -> Polygon:
    centre = Point(projection.to_local(circle.latitude_deg, circle.longitude_deg))
    widen = 1.0 if circle.kind == "inclusion" else 1.0 / math.cos(math.pi / (4 * _SEGMENTS))
    return centre.buffer(circle.radius_m * widen, quad_segs=_SEGMENTS)


def _inside(shapes: list[BaseGeometry], *, all_of_home: bool) -> BaseGeometry | None:
    of_home = [shape for shape in shapes if shape.covers(Point(0.0, 0.0))]
    if not all_of_home or len(of_home) == 0:
        return _union(shapes)
    area = intersection_all(of_home).buffer(0.0)  # without the lines and points at which two only touch
    prepare(area)
    return area


def _union(shapes: list[BaseGeometry]) -> BaseGeometry | None:
    if not shapes:
        return None
    area = union_all(shapes)
    prepare(area)
    return area
