"""Writes a plan in a format of other software."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from app.domain.plan import Plan
from app.interchange.findings import ConversionFinding
from app.interchange.geojson_writer import geojson_text
from app.interchange.kml_writer import kml_text
from app.interchange.qgc_writer import qgc_text

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
    """A name that every file system and every header takes."""
    stem = _UNSAFE.sub("-", plan_name).strip("-.")[:_LONGEST_NAME].lower() or "plan"
    return stem + _SUFFIXES[target]
