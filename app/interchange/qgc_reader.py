"""A QGroundControl .plan to the fields of a plan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from app.domain.finding import json_pointer
from app.domain.mav_type import vehicle_type
from app.domain.mission import MavCmd
from app.domain.vehicle import VehicleType
from app.interchange.extra import apply_plan_extra
from app.interchange.file_item import FileItem
from app.interchange.file_json import FileObject
from app.interchange.findings import Report
from app.interchange.item_reader import ItemReader
from app.interchange.open_yaw import without_zero_yaws
from app.interchange.plan_draft import PlanDraft
from app.interchange.planning_speeds import planning_speeds
from app.interchange.qgc_areas import read_fence, read_rally
from app.interchange.qgc_format import (
    ARDUPILOT,
    FILE_TYPE,
    MISSION_KEYS,
    MISSION_VERSION,
    PLAN_KEYS,
    PLAN_VERSION,
    PX4,
)
from app.interchange.qgc_items import read_qgc_items

_GENERIC: Final = 0
"""MAV_TYPE_GENERIC: the file leaves the vehicle open."""
_VTOL_ONLY: Final = frozenset({MavCmd.NAV_VTOL_TAKEOFF, MavCmd.NAV_VTOL_LAND, MavCmd.DO_VTOL_TRANSITION})


@dataclass(frozen=True, slots=True)
class Unsaid:
    """What the caller says where the file is silent."""

    name: str = "Imported mission"
    vehicle_type: VehicleType | None = None


def read_qgc(document: Mapping[str, Any], unsaid: Unsaid, report: Report) -> PlanDraft:
    """The draft; what is wrong stands in the report. `document` is checked JSON data."""
    top = FileObject(document, "", report)
    if top.typed("fileType", str) not in (FILE_TYPE, None):
        report.refuse("conversion.file_type", "/fileType", f'a .plan has the fileType "{FILE_TYPE}"')
    top.version(PLAN_VERSION)
    top.name_unknown(PLAN_KEYS)
    draft = PlanDraft({"version": 1, "name": unsaid.name}, items_place="/mission/items")
    mission = top.typed("mission", dict)
    if mission is not None:
        _read_mission(FileObject(mission, "/mission", report), draft, unsaid, report)
    fence, rally = top.typed("geoFence", dict, required=False), top.typed("rallyPoints", dict, required=False)
    if fence is not None:
        read_fence(FileObject(fence, "/geoFence", report), draft, report)
    if rally is not None:
        read_rally(FileObject(rally, "/rallyPoints", report), draft, report)
    apply_plan_extra(top, draft, report)
    return draft


def _read_mission(mission: FileObject, draft: PlanDraft, unsaid: Unsaid, report: Report) -> None:
    mission.version(MISSION_VERSION)
    mission.name_unknown(MISSION_KEYS)
    firmware = mission.whole("firmwareType", required=False)
    if firmware not in (PX4, 0, None):
        message = f"the file is for autopilot {firmware}; its items are read as PX4 ({PX4}) flies them"
        report.assume("conversion.firmware", mission.at("firmwareType"), message)
    mode = mission.whole("globalPlanAltitudeMode", required=False)
    items = read_qgc_items(mission.typed("items", list) or (), mission.at("items"), mode, report)
    if firmware == ARDUPILOT:
        items = without_zero_yaws(items, mission.at("firmwareType"), report)
    kind = _vehicle_type(mission, items, unsaid, report)
    draft.fields["vehicle_type"] = kind.value
    draft.places["/vehicle_type"] = mission.at("vehicleType")
    _read_home(mission, draft, report)
    reader = ItemReader(kind, report)
    reader.read(items)
    _name_planning_speeds(mission, planning_speeds(kind, reader.cruise_speed_m_s), report)
    draft.items = reader.drafts
    if reader.cruise_speed_m_s is not None:
        draft.fields["cruise_speed_m_s"] = reader.cruise_speed_m_s


def _vehicle_type(mission: FileObject, items: list[FileItem], unsaid: Unsaid, report: Report) -> VehicleType:
    number = mission.whole("vehicleType", required=False)
    known = vehicle_type(number) if number is not None else None
    if known is not None:
        return known
    if number not in (None, _GENERIC):
        message = f"MAV_TYPE {number} is no vehicle that Waydrop flies"
        report.refuse("conversion.vehicle_type", mission.at("vehicleType"), message)
    return unsaid.vehicle_type or guess_vehicle_type(items, mission.at("vehicleType"), report)


def guess_vehicle_type(items: list[FileItem], pointer: str, report: Report) -> VehicleType:
    """From the commands: VTOL ones are for VTOLs alone, everything else a multicopter may fly."""
    guess = VehicleType.MULTICOPTER
    if any(item.command in _VTOL_ONLY for item in items):
        guess = VehicleType.VTOL
    message = f"the file does not say for which vehicle it is; by its items a {guess} is assumed"
    report.assume("conversion.vehicle_type", pointer, message, "say the vehicle type with the conversion")
    return guess


def _read_home(mission: FileObject, draft: PlanDraft, report: Report) -> None:
    pointer = mission.at("plannedHomePosition")
    if mission.value.get("plannedHomePosition") is None:
        home: list[float | None] | None = [None] * 3
    else:
        home = mission.numbers("plannedHomePosition", 3)
    if home is None:
        return
    names = ("latitude_deg", "longitude_deg", "absolute_altitude_m")
    draft.places |= {json_pointer("home", name): f"{pointer}/{index}" for index, name in enumerate(names)}
    if None in home:
        message = "the planned home position is not complete, so the plan has none"
        report.lose("conversion.home", pointer, message, "the vehicle's own home is used once it is known")
    else:
        draft.fields["home"] = dict(zip(names, home, strict=True))


def _name_planning_speeds(mission: FileObject, usual: Mapping[str, float], report: Report) -> None:
    """cruiseSpeed and hoverSpeed are never sent to a vehicle: as a plan's speeds they would be."""
    for key in ("cruiseSpeed", "hoverSpeed"):
        speed_m_s = mission.number(key, required=False)
        if speed_m_s is not None and speed_m_s != usual[key]:
            message = f"{key} {speed_m_s:g} is for QGroundControl's estimates and never sent: the plan does not say it"
            hint = "set cruise_speed_m_s in the plan if the vehicle is to fly at this speed"
            report.lose("conversion.planning_speed", mission.at(key), message, hint)
