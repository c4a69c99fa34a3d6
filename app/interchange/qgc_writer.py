"""Write a plan as a QGroundControl .plan.

The file is written as any other software would read it, then read back: what the plan contains beyond that goes into
objects called `waydrop`, which others ignore. So nothing of a plan is ever omitted, including fields of later versions.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Final

from app.domain.items import PlanItem
from app.domain.plan import Plan
from app.domain.plan.drops import drops_of
from app.domain.plan.json_tree import MAX_BODY_BYTES
from app.domain.plan.walk import reference_home, walk
from app.domain.vehicle.state import GlobalPosition, usual_mav_type
from app.interchange.findings import ConversionFinding, Report
from app.interchange.item_draft import ABSOLUTE, RELATIVE, FileItem, ItemDraft, ItemExtra
from app.interchange.item_writer import WrittenItem, write_items
from app.interchange.qgc_areas import fence_json, planning_speeds, rally_json
from app.interchange.qgc_format import (
    ALTITUDE_ABSOLUTE,
    ALTITUDE_RELATIVE,
    EXTRA,
    EXTRA_VERSION,
    FILE_TYPE,
    MISSION_VERSION,
    PLAN_VERSION,
    PX4,
)
from app.interchange.qgc_reader import Unsaid, read_qgc

_INDENT: Final = 2
_KNOWN: Final = frozenset({"version", "vehicle_type", "items"})
_SHOWN: Final = ("order", "limits", "contingency", "rally_points")


def qgc_text(plan: Plan) -> tuple[str, tuple[ConversionFinding, ...]]:
    """The file, and what only Waydrop reads in it or nobody does. A large plan is written without spaces."""
    document, findings = qgc_document(plan)
    text = json.dumps(document, indent=_INDENT, ensure_ascii=False, allow_nan=False)
    if len(text.encode()) > MAX_BODY_BYTES // 2:
        text = json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return text + "\n", findings


def qgc_document(plan: Plan) -> tuple[dict[str, Any], tuple[ConversionFinding, ...]]:
    """The file as JSON data."""
    report = Report()
    home = reference_home(plan, None)
    written = write_items(plan, home)
    document = _document(plan, home, written)
    read = read_qgc(document, Unsaid(), Report())
    for wrote, draft, item in zip(written, read.items, plan.items, strict=True):
        extra = _item_extra(item, draft)
        document["mission"]["items"][wrote.items[wrote.main].number - 1][EXTRA] = extra
    said = {name: value for name, value in read.fields.items() if name not in _KNOWN and name != "name"}
    fields, replaced = _difference(_json(plan, _KNOWN), said, _defaults(plan))
    document[EXTRA] = {"version": EXTRA_VERSION, "fields": fields, **({"written": replaced} if replaced else {})}
    _name_what_is_kept(plan, fields, report)
    _name_drops(plan, home, report)
    return document, report.summarized()


def _document(plan: Plan, home: GlobalPosition, written: tuple[WrittenItem, ...]) -> dict[str, Any]:
    return {
        "fileType": FILE_TYPE,
        "geoFence": fence_json(plan.geofence),
        "groundStation": "Waydrop",
        "mission": {
            **planning_speeds(plan.vehicle_type, plan.cruise_speed_m_s),
            "firmwareType": PX4,
            "globalPlanAltitudeMode": ALTITUDE_RELATIVE,
            "items": [_item_json(item) for one in written for item in one.items],
            "plannedHomePosition": [home.latitude_deg, home.longitude_deg, home.altitude_m],
            "vehicleType": usual_mav_type(plan.vehicle_type),
            "version": MISSION_VERSION,
        },
        "rallyPoints": rally_json(plan.rally_points, home.altitude_m),
        "version": PLAN_VERSION,
    }


def _item_json(item: FileItem) -> dict[str, Any]:
    made: dict[str, Any] = {
        "autoContinue": True,
        "command": int(item.command),
        "doJumpId": item.number,
        "frame": int(item.frame),
        "params": list(item.params),
        "type": "SimpleItem",
    }
    if item.frame in RELATIVE | ABSOLUTE:
        mode = ALTITUDE_RELATIVE if item.frame in RELATIVE else ALTITUDE_ABSOLUTE
        made |= {"AMSLAltAboveTerrain": None, "Altitude": item.params[6], "AltitudeMode": mode}
    if item.extra is not None:
        made[EXTRA] = _extra_json(item.extra)
    return made


def _extra_json(extra: ItemExtra) -> dict[str, Any]:
    parts = {"id": extra.id, "role": extra.role, "fields": extra.fields, "written": extra.written}
    return {name: part for name, part in parts.items() if part}


def _item_extra(item: PlanItem, draft: ItemDraft) -> dict[str, Any]:
    defaults = {name: field.default for name, field in type(item).model_fields.items() if not field.is_required()}
    read = {
        name: value for name, value in draft.fields.items() if not (name == "release_motion" and draft.motion_assumed)
    }
    fields, replaced = _difference(_json(item, {"id", "type"}), read, defaults)
    return _extra_json(ItemExtra("", id=item.id, fields=fields, written=replaced))


def _difference(
    meant: Mapping[str, Any], read: Mapping[str, Any], defaults: Mapping[str, Any]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """(fields of the plan that the file lacks, the file's values instead). null equals a missing field."""
    fields: dict[str, Any] = {}
    for name in {**meant, **read}:
        value = meant.get(name)
        if value != (read[name] if name in read else defaults.get(name)):
            fields[name] = value
    return fields, {name: read[name] for name in fields if name in read}


def _json(model: Plan | PlanItem, without: frozenset[str] | set[str]) -> dict[str, Any]:
    return model.model_dump(mode="json", exclude=set(without), exclude_none=True)


def _defaults(plan: Plan) -> dict[str, Any]:
    """The fields of an empty plan as JSON."""
    fields = {name: field for name, field in type(plan).model_fields.items() if not field.is_required()}
    empty = Plan.model_construct(**{name: field.default for name, field in fields.items()})
    return empty.model_dump(mode="json", include=set(fields), exclude_none=True)


def _name_what_is_kept(plan: Plan, fields: Mapping[str, Any], report: Report) -> None:
    for name in _SHOWN:
        if name in fields:
            message = f"{name} is kept for Waydrop only; QGroundControl removes it when it saves the file"
            report.keep("conversion.kept_field", f"/{name}", message)
    if plan.home is None:
        message = "the plan has no home; the planned home position is set below its first position"
        report.assume("conversion.home", "", message, "add a home to the plan")


def _name_drops(plan: Plan, home: GlobalPosition, report: Report) -> None:
    for drop in drops_of(walk(plan, home)):
        pointer = f"/items/{drop.step.index}"
        if drop.supervised:
            nobody = "nobody looks" if drop.item.consent == "none" else "without checks or consent"
            message = f"flown by other software, the mission releases the parcel here: {nobody} before the release"
            report.lose("conversion.supervision", pointer, message, "fly it with Waydrop for a supervised drop")
        if drop.alternate is not None:
            message = "other software does not support alternates and does not show this one; Waydrop reads it back"
            report.keep("conversion.alternate", f"{pointer}/alternate", message)
        message = "how this drop is meant (release_motion, mode, bounds) is kept for Waydrop"
        report.keep("conversion.drop_terms", pointer, message)
