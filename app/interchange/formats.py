"""The formats of other software: which ones are read and written, and how a document's format is recognised."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final

from app.domain.model import Frozen
from app.domain.plan import Plan, PlanInvalid, parse_plan
from app.domain.plan.json_tree import MAX_BODY_BYTES, read_json
from app.domain.plan.parse import long_lists
from app.domain.validation.finding import Finding
from app.domain.vehicle.state import VehicleType
from app.interchange.findings import ConversionFinding, ConversionRefused, Report
from app.interchange.geojson_writer import geojson_text
from app.interchange.kml_writer import kml_text
from app.interchange.plan_draft import finish
from app.interchange.qgc_outline import long_lists_of_qgc
from app.interchange.qgc_reader import Unsaid, read_qgc
from app.interchange.qgc_writer import qgc_text
from app.interchange.waypoints_reader import HEADER, read_waypoints

_KNOWN: Final = "supported are Waydrop plans, .plan files of QGroundControl, and QGC WPL waypoint files"


class SourceFormat(StrEnum):
    """`plan` is Waydrop's own, `qgc` QGroundControl's .plan, `waypoints` the text of Mission Planner."""

    PLAN = "plan"
    QGC = "qgc"
    WAYPOINTS = "waypoints"


@dataclass(frozen=True, slots=True)
class Conversion:
    """The plan, its source format, and what was lost or assumed."""

    plan: Plan
    source: SourceFormat
    findings: tuple[ConversionFinding, ...]


def convert_to_plan(
    raw: bytes,
    *,
    source: SourceFormat | None = None,
    name: str | None = None,
    vehicle_type: VehicleType | None = None,
) -> Conversion:
    """The plan in a document. `name` and `vehicle_type` count where the document says none.

    Raises:
        PlanInvalid: it is a plan of Waydrop's, and unusable; ConversionRefused: any other document that is no plan.
    """
    report = Report()
    text = _decode(raw, report)
    unsaid = Unsaid(name=name or Unsaid().name, vehicle_type=vehicle_type)
    if text.startswith(HEADER):
        found = SourceFormat.WAYPOINTS
        _agree(source, found, report)
        draft = read_waypoints(text, unsaid, report)
    else:
        document = _read_object(text, report)
        found = _json_format(document, report)
        _agree(source, found, report)
        if found is SourceFormat.PLAN:
            return Conversion(parse_plan(text), found, ())
        draft = read_qgc(document, unsaid, report)
    plan = finish(draft, report)
    return Conversion(plan, found, report.summarized())


class PlanConversion(Frozen):
    """The plan, ready for /plan-checks and /plans, with findings for everything lost or assumed."""

    format: SourceFormat
    plan: dict[str, Any]
    findings: tuple[ConversionFinding, ...]


@dataclass(frozen=True, slots=True)
class RefusedDocument:
    """Why a document is no plan. A process cannot send the error itself to another one."""

    kind: type[ConversionRefused | PlanInvalid]
    findings: tuple[Finding, ...]

    def error(self) -> ConversionRefused | PlanInvalid:
        return self.kind(self.findings)


def convert_as_json(
    raw: bytes, source: SourceFormat | None, name: str | None, vehicle_type: VehicleType | None
) -> bytes | RefusedDocument:
    """The PlanConversion as JSON: bytes cost the event loop nothing to receive. Runs in the worker process."""
    try:
        found = convert_to_plan(raw, source=source, name=name, vehicle_type=vehicle_type)
    except (ConversionRefused, PlanInvalid) as error:
        return RefusedDocument(type(error), error.findings)
    plan = found.plan.model_dump(mode="json")
    return PlanConversion(format=found.source, plan=plan, findings=found.findings).model_dump_json().encode()


def _decode(raw: bytes, report: Report) -> str:
    if len(raw) > MAX_BODY_BYTES:
        raise report.refused(
            "conversion.too_large", f"the document has {len(raw)} bytes; the limit is {MAX_BODY_BYTES}"
        )
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        message = f"this is not UTF-8: {error.reason} at byte {error.start}"
        raise report.refused("conversion.encoding", message) from error


def _read_object(text: str, report: Report) -> dict[str, Any]:
    if text.lstrip().startswith("<"):
        raise report.refused(
            "conversion.format", "KML and other XML can only be exported: it does not define a mission", _KNOWN
        )
    tree = read_json(text, _long_lists)
    report.refusals += tree.findings
    report.stop_if_refused()
    if isinstance(tree.value, dict):
        return tree.value
    raise report.refused("conversion.format", "unknown document format", _KNOWN)


def _long_lists(document: object) -> list[Finding]:
    """Before anything is copied: what is far too long is refused at once, and costs no more than its bytes."""
    if not isinstance(document, dict):
        return []
    return long_lists_of_qgc(document) if _is_qgc(document) else long_lists(document)


def _is_qgc(document: dict[str, Any]) -> bool:
    return "fileType" in document or "mission" in document


def _json_format(document: dict[str, Any], report: Report) -> SourceFormat:
    if _is_qgc(document):
        return SourceFormat.QGC
    if "items" in document or "vehicle_type" in document:
        return SourceFormat.PLAN
    message = "unknown document format"
    if document.get("type") in ("FeatureCollection", "Feature"):
        message = "GeoJSON can only be exported: it does not define a mission"
    raise report.refused("conversion.format", message, _KNOWN)


def _agree(asked: SourceFormat | None, found: SourceFormat, report: Report) -> None:
    if asked not in (None, found):
        message = f"the requested format is {asked}, but the content is {found}"
        raise report.refused("conversion.format", message, "omit the format")


_UNSAFE: Final = re.compile(r"[^A-Za-z0-9._-]+")
_LONGEST_NAME: Final = 80


class TargetFormat(StrEnum):
    """`qgc` is QGroundControl's .plan, which can be read back; the others are for maps."""

    QGC = "qgc"
    GEOJSON = "geojson"
    KML = "kml"


MEDIA_TYPES: Final[Mapping[TargetFormat, str]] = {
    TargetFormat.QGC: "application/json",
    TargetFormat.GEOJSON: "application/geo+json",
    TargetFormat.KML: "application/vnd.google-earth.kml+xml",
}
_SUFFIXES: Final = {TargetFormat.QGC: ".plan", TargetFormat.GEOJSON: ".geojson", TargetFormat.KML: ".kml"}
_WRITERS: Final[Mapping[TargetFormat, Callable[[Plan], tuple[str, tuple[ConversionFinding, ...]]]]] = {
    TargetFormat.QGC: qgc_text,
    TargetFormat.GEOJSON: geojson_text,
    TargetFormat.KML: kml_text,
}


@dataclass(frozen=True, slots=True)
class Exported:
    """The document, and what of the plan it does not have or only Waydrop reads in it."""

    text: str
    findings: tuple[ConversionFinding, ...]


def export_plan(plan: Plan, target: TargetFormat) -> Exported:
    """Any plan can be written, one with errors too. Slow for hundreds of items: call it in a thread."""
    text, findings = _WRITERS[target](plan)
    return Exported(text, findings)


def file_name(plan_name: str, target: TargetFormat) -> str:
    """Return a name that every file system and every header accepts."""
    stem = _UNSAFE.sub("-", plan_name).strip("-.")[:_LONGEST_NAME].lower() or "plan"
    return stem + _SUFFIXES[target]
