"""The geofence and the rally points as mission items of their own lists."""

from __future__ import annotations

from collections.abc import Iterator

from app.domain.items.draft import degrees_e7
from app.domain.mission import MavCmd, MavFrame, MissionItem, MissionType
from app.domain.plan.geofence import Geofence, RallyPoint

_VERTEX = {
    "inclusion": MavCmd.NAV_FENCE_POLYGON_VERTEX_INCLUSION,
    "exclusion": MavCmd.NAV_FENCE_POLYGON_VERTEX_EXCLUSION,
}
_CIRCLE = {"inclusion": MavCmd.NAV_FENCE_CIRCLE_INCLUSION, "exclusion": MavCmd.NAV_FENCE_CIRCLE_EXCLUSION}


def fence_items(fence: Geofence) -> tuple[MissionItem, ...]:
    """param1 of a vertex is the number of vertices of its polygon, of a circle its radius in metres."""
    points = enumerate(_fence_points(fence))
    return tuple(_fence_item(seq, command, param1, x, y) for seq, (command, param1, x, y) in points)


def rally_items(points: tuple[RallyPoint, ...]) -> tuple[MissionItem, ...]:
    """NAV_RALLY_POINT items; unused parameters are 0 as PX4 reads them back."""
    return tuple(_rally_item(seq, point) for seq, point in enumerate(points))


def _fence_points(fence: Geofence) -> Iterator[tuple[MavCmd, float, int, int]]:
    for polygon in fence.polygons:
        for vertex in polygon.vertices:
            corner = degrees_e7(vertex.latitude_deg), degrees_e7(vertex.longitude_deg)
            yield _VERTEX[polygon.kind], float(len(polygon.vertices)), *corner
    for circle in fence.circles:
        yield _CIRCLE[circle.kind], circle.radius_m, degrees_e7(circle.latitude_deg), degrees_e7(circle.longitude_deg)


def _fence_item(seq: int, command: MavCmd, param1: float, x: int, y: int) -> MissionItem:
    # Frame 5 and autocontinue 0 are what PX4 reads back whatever was sent (seen on the wire).
    return MissionItem(
        seq,
        MavFrame.GLOBAL_INT,
        command,
        param1,
        0.0,
        0.0,
        0.0,
        x=x,
        y=y,
        current=seq == 0,
        autocontinue=False,
        mission_type=MissionType.FENCE,
    )


def _rally_item(seq: int, point: RallyPoint) -> MissionItem:
    absolute = point.absolute_altitude_m
    return MissionItem(
        seq,
        MavFrame.GLOBAL_RELATIVE_ALT_INT if absolute is None else MavFrame.GLOBAL_INT,
        MavCmd.NAV_RALLY_POINT,
        0.0,
        0.0,
        0.0,
        0.0,
        x=degrees_e7(point.latitude_deg),
        y=degrees_e7(point.longitude_deg),
        z=point.relative_altitude_m or 0.0 if absolute is None else absolute,
        current=seq == 0,
        mission_type=MissionType.RALLY,
    )
