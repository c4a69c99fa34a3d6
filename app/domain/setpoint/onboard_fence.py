"""The fence as it is on board: from the vehicle's own list to areas in metres around home."""

from __future__ import annotations

from collections.abc import Sequence

from app.domain.fence_area import FenceArea, fence_area
from app.domain.geo import LocalProjection
from app.domain.items.fields import Point
from app.domain.mission import MavCmd, MissionItem
from app.domain.plan.geofence import FenceCircle, FenceKind, FencePolygon, Geofence

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
    """The area of a downloaded fence list; None if it has none. A polygon's corners say by param1 how many they are.

    The projection's origin is home: a place must lie in any inclusion, or in all of those around home.
    """
    polygons: list[FencePolygon] = []
    circles: list[FenceCircle] = []
    corners: list[Point] = []
    for item in items:
        place = Point(latitude_deg=item.x / 1e7, longitude_deg=item.y / 1e7)
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
