"""A plan as GeoJSON (RFC 7946): items, predicted legs and releases, drops, fence, rally points, home.

Positions have no third number: RFC 7946 means a height above the ellipsoid, which a plan does not know. Altitudes are
properties, by the names of the plan.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any

from app.domain.autopilot.declared import default_facts
from app.domain.plan import Plan
from app.domain.plan.drops import drops_of
from app.domain.plan.walk import reference_home, walk
from app.domain.prediction import Timeline, predict
from app.interchange.findings import ConversionFinding, Report
from app.interchange.map_shapes import Coordinate, circle_ring, line_parts, polygon_parts

Feature = dict[str, Any]


def geojson_text(plan: Plan) -> tuple[str, tuple[ConversionFinding, ...]]:
    """The FeatureCollection. What has no place on a map is a feature without geometry, or stands in `waydrop`."""
    report = Report()
    timeline = predict(plan, default_facts(plan.vehicle_type))
    features = [
        *_home(plan),
        *_items(plan),
        *_legs(plan, timeline),
        *_drops(plan),
        *_alternates(plan),
        *_releases(timeline),
        *_fence(plan, report),
        *_rally(plan),
    ]
    rest = plan.model_dump(mode="json", exclude={"items", "geofence", "rally_points", "home"}, exclude_none=True)
    document = {"type": "FeatureCollection", "features": features, "waydrop": rest}
    return json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1) + "\n", report.summarized()


def _feature(role: str, geometry: dict[str, Any] | None, **properties: Any) -> Feature:
    return {"type": "Feature", "geometry": geometry, "properties": {"role": role, **properties}}


def _point(latitude_deg: float | None, longitude_deg: float | None) -> dict[str, Any] | None:
    if latitude_deg is None or longitude_deg is None:
        return None
    return {"type": "Point", "coordinates": [longitude_deg, latitude_deg]}


def _home(plan: Plan) -> Iterator[Feature]:
    if plan.home is not None:
        place = _point(plan.home.latitude_deg, plan.home.longitude_deg)
        yield _feature("home", place, absolute_altitude_m=plan.home.absolute_altitude_m)


def _items(plan: Plan) -> Iterator[Feature]:
    """Every item in order; those without a position have no geometry."""
    for number, item in enumerate(plan.items, start=1):
        fields = item.model_dump(mode="json", exclude_none=True)
        place = _point(fields.pop("latitude_deg", None), fields.pop("longitude_deg", None))
        yield _feature("item", place, order=number, **fields)


def _legs(plan: Plan, timeline: Timeline) -> Iterator[Feature]:
    """The predicted route: each visit of an item, from where the vehicle was."""
    home = reference_home(plan, None)
    here: Coordinate = (home.longitude_deg, home.latitude_deg)
    for entry in timeline.entries:
        there = (entry.longitude_deg, entry.latitude_deg)
        lines = line_parts([here, there])
        here = there
        if lines:
            yield _feature(
                "leg",
                {"type": "LineString", "coordinates": lines[0]}
                if len(lines) == 1
                else {"type": "MultiLineString", "coordinates": lines},
                to=entry.item_id,
                visit=entry.visit,
                distance_m=entry.distance_m,
                start_s=entry.start_s,
                end_s=entry.end_s,
                ground_speed_m_s=entry.ground_speed_m_s,
                relative_altitude_m=entry.relative_altitude_m,
            )


def _drops(plan: Plan) -> Iterator[Feature]:
    """Where the plan wants each parcel: the place of the item before the drop."""
    for drop in drops_of(walk(plan, reference_home(plan, None))):
        end = drop.anchor.end if drop.anchor is not None else drop.step.end
        yield _feature(
            "drop",
            _point(end.latitude_deg, end.longitude_deg),
            item_id=drop.item.id,
            order=drop.step.index + 1,
            action=drop.item.action,
            release_motion=drop.item.release_motion,
            supervised=drop.supervised,
            relative_altitude_m=end.relative_altitude_m,
        )


def _alternates(plan: Plan) -> Iterator[Feature]:
    """Where a parcel goes if its drop fails."""
    for drop, alternate in plan.alternates:
        fields = alternate.model_dump(mode="json", exclude_none=True, exclude={"id"})
        place = _point(fields.pop("latitude_deg"), fields.pop("longitude_deg"))
        yield _feature("alternate", place, item_id=alternate.id, drop=drop.id, **fields)


def _releases(timeline: Timeline) -> Iterator[Feature]:
    """Where each drop is predicted to act; no place on a circle, where it can be anywhere."""
    for drop in timeline.drops:
        place = _point(drop.release_latitude_deg, drop.release_longitude_deg)
        names = {"release_latitude_deg", "release_longitude_deg"}
        yield _feature("predicted_release", place, **drop.model_dump(mode="json", exclude=names))


def _fence(plan: Plan, report: Report) -> Iterator[Feature]:
    for polygon in plan.geofence.polygons:
        ring = [(vertex.longitude_deg, vertex.latitude_deg) for vertex in polygon.vertices]
        yield _feature("fence", _area(polygon_parts(ring)), fence=polygon.kind)
    for index, circle in enumerate(plan.geofence.circles):
        around = circle_ring(circle.latitude_deg, circle.longitude_deg, circle.radius_m)
        shape = _point(circle.latitude_deg, circle.longitude_deg)
        if around is None:
            message = "this circle contains a pole, which a GeoJSON polygon cannot; only its centre is written"
            report.lose("conversion.polar_circle", f"/geofence/circles/{index}", message)
        else:
            shape = _area(polygon_parts(around))
        centre = {"latitude_deg": circle.latitude_deg, "longitude_deg": circle.longitude_deg}
        yield _feature("fence", shape, fence=circle.kind, radius_m=circle.radius_m, **centre)


def _area(rings: Sequence[list[Coordinate]]) -> dict[str, Any]:
    if len(rings) == 1:
        return {"type": "Polygon", "coordinates": [rings[0]]}
    return {"type": "MultiPolygon", "coordinates": [[ring] for ring in rings]}


def _rally(plan: Plan) -> Iterator[Feature]:
    for number, point in enumerate(plan.rally_points, start=1):
        fields = point.model_dump(mode="json", exclude_none=True)
        place = _point(fields.pop("latitude_deg"), fields.pop("longitude_deg"))
        yield _feature("rally_point", place, order=number, **fields)
