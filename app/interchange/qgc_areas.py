"""Geofence and rally points of a .plan, both ways."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from app.domain.autopilot.declared import default_facts
from app.domain.plan.document import Geofence, RallyPoint
from app.domain.plan.walk import cruise_speed_m_s
from app.domain.vehicle.state import FlightRegime, VehicleType
from app.interchange.findings import FileObject, Report, read_numbers
from app.interchange.plan_draft import PlanDraft
from app.interchange.qgc_format import FENCE_PART_VERSION, FENCE_VERSION, RALLY_VERSION

_ROTARY = frozenset({VehicleType.MULTICOPTER, VehicleType.AIRSHIP, VehicleType.ROVER})


def planning_speeds(vehicle_type: VehicleType, cruise_m_s: float | None) -> dict[str, float]:
    """`cruiseSpeed` (wings) and `hoverSpeed` of a .plan, out of the plan's cruise speed or the vehicle's usual ones."""
    wings = cruise_speed_m_s(default_facts(VehicleType.FIXED_WING), FlightRegime.FIXED_WING)
    rotors = cruise_speed_m_s(default_facts(VehicleType.MULTICOPTER), FlightRegime.ROTARY_WING)
    if cruise_m_s is not None:
        wings, rotors = (wings, cruise_m_s) if vehicle_type in _ROTARY else (cruise_m_s, rotors)
    return {"cruiseSpeed": wings, "hoverSpeed": rotors}


_KIND = {True: "inclusion", False: "exclusion"}


def read_fence(fence: FileObject, draft: PlanDraft, report: Report) -> None:
    """Into `geofence`. A fence of an older version is refused: to fly without it is no small loss."""
    fence.version(FENCE_VERSION)
    fence.name_unknown({"circles", "polygons", "version"})
    made: dict[str, list[Any]] = {"polygons": [], "circles": []}
    for key, read in (("polygons", _read_polygon), ("circles", _read_circle)):
        for index, value in enumerate(fence.typed(key, list) or ()):
            place = f"{fence.at(key)}/{index}"
            if not isinstance(value, dict):
                report.refuse("conversion.wrong_type", place, "this must be an object")
                continue
            part = FileObject(value, place, report)
            part.version(FENCE_PART_VERSION)
            inclusion = part.typed("inclusion", bool)
            shape = read(part, f"/geofence/{key}/{len(made[key])}", draft, report)
            if inclusion is not None and shape is not None:
                made[key].append({"kind": _KIND[inclusion], **shape})
    draft.fields["geofence"] = made
    draft.places["/geofence"] = fence.pointer


def _read_polygon(part: FileObject, target: str, draft: PlanDraft, report: Report) -> dict[str, Any] | None:
    part.name_unknown({"polygon", "inclusion", "version"})
    corners = part.typed("polygon", list)
    if corners is None:
        return None
    draft.places[target] = part.pointer
    vertices = []
    for index, value in enumerate(corners):
        place = f"{part.at('polygon')}/{index}"
        corner = read_numbers(value, place, 2, report)
        if corner is not None:
            draft.places[f"{target}/vertices/{index}"] = place
            vertices.append({"latitude_deg": corner[0], "longitude_deg": corner[1]})
    return {"vertices": vertices}


def _read_circle(part: FileObject, target: str, draft: PlanDraft, report: Report) -> dict[str, Any] | None:
    part.name_unknown({"circle", "inclusion", "version"})
    value = part.typed("circle", dict)
    if value is None:
        return None
    circle = FileObject(value, part.at("circle"), report)
    circle.name_unknown({"center", "radius", "version"})
    centre, radius_m = circle.numbers("center", 2), circle.number("radius")
    if centre is None or radius_m is None:
        return None
    draft.places |= {target: part.pointer, f"{target}/radius_m": circle.at("radius")}
    draft.places |= {f"{target}/{name}": circle.at("center") for name in ("latitude_deg", "longitude_deg")}
    return {"latitude_deg": centre[0], "longitude_deg": centre[1], "radius_m": radius_m}


def read_rally(rally: FileObject, draft: PlanDraft, report: Report) -> None:
    """Into `rally_points`: the documented altitude is above home."""
    rally.version(RALLY_VERSION)
    rally.name_unknown({"points", "version"})
    points: list[dict[str, Any]] = []
    for index, value in enumerate(rally.typed("points", list) or ()):
        place = f"{rally.at('points')}/{index}"
        point = read_numbers(value, place, 3, report)
        if point is None:
            continue
        if None in point:
            report.refuse("conversion.missing", place, "a rally point needs latitude, longitude and altitude")
            continue
        draft.places[f"/rally_points/{len(points)}"] = place
        points.append({"latitude_deg": point[0], "longitude_deg": point[1], "relative_altitude_m": point[2]})
    draft.fields["rally_points"] = points
    draft.places["/rally_points"] = rally.pointer


def fence_json(fence: Geofence) -> dict[str, Any]:
    """The `geoFence` object."""
    polygons = [
        {
            "inclusion": polygon.kind == "inclusion",
            "polygon": [[vertex.latitude_deg, vertex.longitude_deg] for vertex in polygon.vertices],
            "version": FENCE_PART_VERSION,
        }
        for polygon in fence.polygons
    ]
    circles = [
        {
            "circle": {"center": [circle.latitude_deg, circle.longitude_deg], "radius": circle.radius_m},
            "inclusion": circle.kind == "inclusion",
            "version": FENCE_PART_VERSION,
        }
        for circle in fence.circles
    ]
    return {"circles": circles, "polygons": polygons, "version": FENCE_VERSION}


def rally_json(points: Sequence[RallyPoint], home_altitude_m: float) -> dict[str, Any]:
    """The `rallyPoints` object; altitudes above sea level become altitudes above home."""
    made = [
        [
            point.latitude_deg,
            point.longitude_deg,
            point.relative_altitude_m
            if point.relative_altitude_m is not None
            else (point.absolute_altitude_m or 0.0) - home_altitude_m,
        ]
        for point in points
    ]
    return {"points": made, "version": RALLY_VERSION}
