"""A plan as KML 2.2: items in order, the predicted route, drops, fence, rally points, each in a folder.

Altitudes are above sea level if the plan or its home defines it (`absolute`); without a home, metres above home are
drawn as metres above the ground (`relativeToGround`), with a finding.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final
from xml.etree import ElementTree as Xml

from app.domain.autopilot.declared import default_facts
from app.domain.geo import LatLon
from app.domain.items import PlanItem, PositionItem
from app.domain.plan import Plan
from app.domain.plan.drops import alternate_items, drops_of
from app.domain.plan.walk import reference_home, walk
from app.domain.prediction import predict
from app.interchange.findings import ConversionFinding, Report
from app.interchange.map_shapes import Coordinate, circle_ring, line_parts, polygon_parts

_NAMESPACE: Final = "http://www.opengis.net/kml/2.2"
_NOT_XML: Final = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")
_STYLES: Final = {"route": "ffdd8800", "inclusion": "ff00aa00", "exclusion": "ff0000dd"}
"""aabbggrr, as KML has it."""


@dataclass(frozen=True, slots=True)
class _Heights:
    """How metres above home are drawn. `home_m` is None if the altitude of home is unknown."""

    home_m: float | None

    @property
    def mode(self) -> str:
        return "relativeToGround" if self.home_m is None else "absolute"

    def of(self, relative_m: float) -> float:
        return relative_m + (self.home_m or 0.0)


def kml_text(plan: Plan) -> tuple[str, tuple[ConversionFinding, ...]]:
    """The document, and the findings about what it omits."""
    report = Report()
    heights = _Heights(plan.home.absolute_altitude_m if plan.home is not None else None)
    root = Xml.Element("kml", xmlns=_NAMESPACE)
    document = _child(root, "Document")
    _text(document, "name", plan.name)
    _text(document, "description", f"Delivery plan for a {plan.vehicle_type.value}")
    for name, colour in _STYLES.items():
        style = _child(document, "Style", id=name)
        line = _child(style, "LineStyle")
        _text(line, "color", colour)
        _text(line, "width", "3")
        _text(_child(style, "PolyStyle"), "fill", "0")
    _add_items(document, plan, heights)
    _add_route(document, plan, heights)
    _add_drops(document, plan, heights)
    _add_fence(document, plan, report)
    _add_rally(document, plan, heights)
    _name_what_is_lost(plan, heights, report)
    Xml.indent(root)
    return Xml.tostring(root, encoding="unicode", xml_declaration=True) + "\n", report.summarized()


def _name_what_is_lost(plan: Plan, heights: _Heights, report: Report) -> None:
    if heights.home_m is None:
        message = "the plan has no home, so altitudes above home are drawn above the ground"
        report.assume("conversion.home", "", message, "add a home to the plan")
    for name in ("order", "limits", "contingency", "cruise_speed_m_s"):
        if getattr(plan, name) not in (None, type(plan).model_fields[name].default):
            report.lose("conversion.no_place", f"/{name}", f"KML cannot contain {name}")


def _child(parent: Xml.Element, tag: str, **attributes: str) -> Xml.Element:
    return Xml.SubElement(parent, tag, attributes)


def _text(parent: Xml.Element, name: str, text: str) -> Xml.Element:
    """Characters that XML does not have become U+FFFD."""
    child = _child(parent, name)
    child.text = _NOT_XML.sub("\ufffd", text)
    return child


def _folder(document: Xml.Element, name: str) -> Xml.Element:
    folder = _child(document, "Folder")
    _text(folder, "name", name)
    return folder


def _placemark(folder: Xml.Element, name: str, data: Iterable[tuple[str, Any]] = (), style: str = "") -> Xml.Element:
    mark = _child(folder, "Placemark")
    _text(mark, "name", name)
    if style:
        _text(mark, "styleUrl", f"#{style}")
    values = list(data)
    if values:
        extended = _child(mark, "ExtendedData")
        for key, value in values:
            _text(_child(extended, "Data", name=key), "value", str(value))
    return mark


def _add_point(mark: Xml.Element, place: LatLon, heights: _Heights) -> None:
    point = _child(mark, "Point")
    _text(point, "altitudeMode", heights.mode)
    altitude_m = heights.of(place.relative_altitude_m)
    _text(point, "coordinates", f"{place.longitude_deg!r},{place.latitude_deg!r},{altitude_m!r}")


def _add_items(document: Xml.Element, plan: Plan, heights: _Heights) -> None:
    """All items, numbered as the plan has them; only those with a position are on the map."""
    folder = _folder(document, "Items")
    for step in walk(plan, reference_home(plan, None)):
        mark = _placemark(folder, f"{step.index + 1} {step.item.id}", _data(step.item))
        if isinstance(step.item, PositionItem):
            _add_point(mark, step.end, heights)


def _data(item: PlanItem) -> Iterable[tuple[str, Any]]:
    return ((name, value) for name, value in item.model_dump(mode="json", exclude_none=True).items() if name != "id")


def _add_route(document: Xml.Element, plan: Plan, heights: _Heights) -> None:
    """One line a leg, both ends at their altitude."""
    folder = _folder(document, "Predicted route")
    home = reference_home(plan, None)
    here = LatLon(home.latitude_deg, home.longitude_deg, 0.0)
    for entry in predict(plan, default_facts(plan.vehicle_type)).entries:
        there = LatLon(entry.latitude_deg, entry.longitude_deg, entry.relative_altitude_m)
        ends: list[Coordinate] = [(place.longitude_deg, place.latitude_deg) for place in (here, there)]
        climbs = here.relative_altitude_m != there.relative_altitude_m
        lines = line_parts(ends) or ([ends] if climbs else [])
        data = (("start_s", round(entry.start_s, 1)), ("end_s", round(entry.end_s, 1)))
        for number, line in enumerate(lines):
            mark = _placemark(folder, f"to {entry.item_id}", data, "route")
            heights_m = (
                heights.of(here.relative_altitude_m if number == 0 else there.relative_altitude_m),
                heights.of(there.relative_altitude_m),
            )
            _add_line(mark, line, heights_m, heights.mode)
        here = there


def _add_line(mark: Xml.Element, line: Sequence[Coordinate], altitudes_m: tuple[float, float], mode: str) -> None:
    shape = _child(mark, "LineString")
    _text(shape, "tessellate", "1")
    _text(shape, "altitudeMode", mode)
    last = len(line) - 1
    points = (
        f"{longitude!r},{latitude!r},{altitudes_m[1 if index == last else 0]!r}"
        for index, (longitude, latitude) in enumerate(line)
    )
    _text(shape, "coordinates", " ".join(points))


def _add_drops(document: Xml.Element, plan: Plan, heights: _Heights) -> None:
    folder = _folder(document, "Drops")
    home = reference_home(plan, None)
    for drop in drops_of(walk(plan, home)):
        end = drop.anchor.end if drop.anchor is not None else drop.step.end
        data = [
            *(("action", drop.item.action), ("release_motion", drop.item.release_motion)),
            ("supervised", str(drop.supervised).lower()),
        ]
        _add_point(_placemark(folder, drop.item.id, data), end, heights)
        if drop.alternate is not None:
            there = alternate_items(drop.alternate)[0].end_of(home, end)
            mark = _placemark(folder, drop.alternate.id, [("alternate_to", drop.item.id)])
            _add_point(mark, there, heights)


def _add_fence(document: Xml.Element, plan: Plan, report: Report) -> None:
    folder = _folder(document, "Geofence")
    for number, polygon in enumerate(plan.geofence.polygons, start=1):
        ring = [(vertex.longitude_deg, vertex.latitude_deg) for vertex in polygon.vertices]
        _add_area(folder, f"{polygon.kind} {number}", polygon.kind, polygon_parts(ring), ())
    for index, circle in enumerate(plan.geofence.circles):
        around = circle_ring(circle.latitude_deg, circle.longitude_deg, circle.radius_m)
        if around is None:
            message = "this circle contains a pole, which a KML polygon cannot; it is omitted"
            report.lose("conversion.polar_circle", f"/geofence/circles/{index}", message)
            continue
        radius = (("radius_m", circle.radius_m),)
        _add_area(folder, f"{circle.kind} circle {index + 1}", circle.kind, polygon_parts(around), radius)


def _add_area(
    folder: Xml.Element, name: str, kind: str, rings: Iterable[list[Coordinate]], data: Iterable[tuple[str, Any]]
) -> None:
    """Flat on the ground: a fence of PX4 has no height of its own."""
    for ring in rings:
        mark = _placemark(folder, name, data, kind)
        shape = _child(mark, "Polygon")
        _text(shape, "tessellate", "1")
        _text(shape, "altitudeMode", "clampToGround")
        line = _child(_child(shape, "outerBoundaryIs"), "LinearRing")
        _text(line, "coordinates", " ".join(f"{longitude!r},{latitude!r}" for longitude, latitude in ring))


def _add_rally(document: Xml.Element, plan: Plan, heights: _Heights) -> None:
    folder = _folder(document, "Rally points")
    home_m = heights.home_m or 0.0
    for number, point in enumerate(plan.rally_points, start=1):
        relative_m = point.relative_altitude_m
        if relative_m is None:
            relative_m = (point.absolute_altitude_m or 0.0) - home_m
        place = LatLon(point.latitude_deg, point.longitude_deg, relative_m)
        _add_point(_placemark(folder, f"rally point {number}"), place, heights)
