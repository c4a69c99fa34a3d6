"""A QGroundControl .plan to the fields of a plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from app.domain.mission import MavCmd, MavFrame
from app.domain.validation.finding import json_pointer
from app.domain.vehicle.state import VehicleType, vehicle_type
from app.interchange.findings import FileObject, Report, is_number
from app.interchange.item_draft import ABSOLUTE, RELATIVE, FileItem, ItemExtra
from app.interchange.item_reader import ItemReader, without_zero_yaws
from app.interchange.plan_draft import PlanDraft, apply_plan_extra
from app.interchange.qgc_areas import planning_speeds, read_fence, read_rally
from app.interchange.qgc_format import (
    ALTITUDE_ABOVE_TERRAIN,
    ALTITUDE_ABSOLUTE,
    ALTITUDE_RELATIVE,
    ARDUPILOT,
    EXTRA,
    FILE_TYPE,
    ITEM_KEYS,
    LANDING_KEYS,
    MISSION_KEYS,
    MISSION_VERSION,
    PLAN_KEYS,
    PLAN_VERSION,
    PX4,
)

LANDINGS: Final = {"fwLandingPattern": MavCmd.NAV_LAND, "vtolLandingPattern": MavCmd.NAV_VTOL_LAND}
_APPROACH_COLUMNS: Final = (
    *("", "/loiterRadius", "", ""),
    *(f"/landingApproachCoordinate/{index}" for index in range(3)),
)
_LAND_COLUMNS: Final = ("", "", "", "", *(f"/landCoordinate/{index}" for index in range(3)))


def landing_items(item: FileObject, number: int, report: Report) -> list[FileItem]:
    """DO_LAND_START, the approach, the landing: numbered on from `number`, as QGroundControl numbers them."""
    kind = LANDINGS[item.value["complexItemType"]]
    approach = item.numbers("landingApproachCoordinate", 3)
    land = item.numbers("landCoordinate", 3)
    relative = item.typed("altitudesAreRelative", bool)
    circles = item.typed("useLoiterToAlt", bool, required=False)
    radius = item.number("loiterRadius")
    clockwise = item.typed("loiterClockwise", bool)
    _name_what_is_lost(item, report)
    if approach is None or land is None or relative is None or radius is None or clockwise is None:
        return []
    frame = MavFrame.GLOBAL_RELATIVE_ALT if relative else MavFrame.GLOBAL
    command = MavCmd.NAV_WAYPOINT if circles is False else MavCmd.NAV_LOITER_TO_ALT
    turn = radius if clockwise else -radius
    params = (0.0, 0.0, 0.0, None, *approach) if circles is False else (1.0, turn, 0.0, 1.0, *approach)
    place = item.pointer
    start = FileItem(MavCmd.DO_LAND_START, MavFrame.MISSION, (0.0,) * 7, number, place, ("",) * 7)
    circle = FileItem(command, frame, params, number + 1, place, _APPROACH_COLUMNS)
    touchdown = FileItem(kind, frame, (0.0, 0.0, 0.0, None, *land), number + 2, place, _LAND_COLUMNS)
    return [start, circle, touchdown]


def _name_what_is_lost(item: FileObject, report: Report) -> None:
    for key, what in (("stopTakingPhotos", "photos"), ("stopVideoPhotos", "video")):
        if item.value.get(key) is True:
            message = f"the end of taking {what} is omitted: a plan has no camera items"
            report.lose("conversion.camera", item.at(key), message)
    if item.value.get("useDoChangeSpeed") is True:
        message = "the speed of the final approach is omitted"
        report.lose("conversion.parameter", item.at("useDoChangeSpeed"), message, "insert a change_speed item before")
    item.name_unknown(LANDING_KEYS)


_ROLES: Final = ("speed", "pause", "cruise_speed", "wait")
_EXTRA_KEYS: Final = frozenset({"id", "role", "fields", "written"})
_SAME_M: Final = 0.01
_OTHER_REFERENCE: Final = {ALTITUDE_RELATIVE: ABSOLUTE, ALTITUDE_ABSOLUTE: RELATIVE}


def read_qgc_items(items: Sequence[Any], pointer: str, altitude_mode: int | None, report: Report) -> list[FileItem]:
    """All mission items that the file stands for, in order; what cannot be read is refused and left out."""
    found: list[FileItem] = []
    for index, value in enumerate(items):
        place = f"{pointer}/{index}"
        if not isinstance(value, dict):
            report.refuse("conversion.wrong_type", place, "an item must be an object")
            continue
        item = FileObject(value, place, report)
        kind = item.typed("type", str)
        if kind == "ComplexItem":
            found += _complex(item, len(found) + 1, report)
        elif kind == "SimpleItem":
            simple = _simple(item, len(found) + 1, altitude_mode, report)
            found += [simple] if simple is not None else []
        elif kind is not None:
            report.refuse("conversion.item_type", item.at("type"), f"unknown item type {kind!r}")
    return found


def _complex(item: FileObject, number: int, report: Report) -> list[FileItem]:
    kind = item.typed("complexItemType", str)
    if kind in LANDINGS:
        return landing_items(item, number, report)
    if kind is not None:
        message = f"the complex item {kind!r} is expanded by QGroundControl only"
        hint = "a delivery plan has no surveys; remove it, or convert it to simple items"
        report.refuse("conversion.complex_item", item.at("complexItemType"), message, hint)
    return []


def _simple(item: FileObject, number: int, altitude_mode: int | None, report: Report) -> FileItem | None:
    command, frame = item.whole("command"), item.whole("frame")
    params = item.numbers("params", 7)
    jump_id = item.whole("doJumpId", required=False)
    if item.typed("autoContinue", bool) is False:
        message = "the mission waits after this item until it is advanced; a plan has no such item"
        hint = "end the plan with a loiter of kind unlimited, or use a delay"
        report.refuse("conversion.auto_continue", item.at("autoContinue"), message, hint)
    item.name_unknown(ITEM_KEYS)
    extra = read_extra(item, report)
    if command is None or frame is None or params is None:
        return None
    if params[4] is not None or params[5] is not None:
        _check_altitude(item, frame, params[6], altitude_mode, report)
    numbered = number if jump_id is None else jump_id
    return FileItem(command, frame, tuple(params), numbered, item.pointer, extra=extra)


def _check_altitude(
    item: FileObject, frame: int, given_m: float | None, altitude_mode: int | None, report: Report
) -> None:
    """QGroundControl shows `Altitude` and `AltitudeMode`, and sends param7 and the frame as they were loaded."""
    mode = item.whole("AltitudeMode", required=False) if "AltitudeMode" in item.value else altitude_mode
    shown_m = item.value.get("Altitude")
    if shown_m is not None and not is_number(shown_m):
        report.refuse("conversion.wrong_type", item.at("Altitude"), "Altitude must be a number or null")
        return
    if frame not in RELATIVE | ABSOLUTE:
        return
    if mode == ALTITUDE_ABOVE_TERRAIN:
        message = "the altitude was computed from a height above terrain; the plan has only the altitude"
        report.lose("conversion.above_terrain", item.at("AltitudeMode"), message)
    elif shown_m is not None and given_m is not None and abs(shown_m - given_m) > _SAME_M:
        message = f"Altitude says {shown_m:g} m; {given_m:g} m is used (param7), as QGroundControl would send it"
        report.assume(
            "conversion.two_altitudes", item.at("Altitude"), message, "make them equal if this is not intended"
        )
    elif "AltitudeMode" in item.value and frame in _OTHER_REFERENCE.get(mode or 0, ()):
        message = f"AltitudeMode {mode} is not that of frame {frame}, which is taken, as QGroundControl would send it"
        hint = "make them consistent if this is not intended"
        report.assume("conversion.two_altitudes", item.at("AltitudeMode"), message, hint)


def read_extra(item: FileObject, report: Report) -> ItemExtra | None:
    """The item's `waydrop` object, if it has one."""
    value = item.typed(EXTRA, dict, required=False)
    if value is None:
        return None
    extra = FileObject(value, item.at(EXTRA), report)
    for key in sorted(set(value) - _EXTRA_KEYS):
        report.refuse("conversion.extra", extra.at(key), f"a waydrop object has no field {key!r}")
    role = extra.typed("role", str, required=False) or ""
    if role and role not in _ROLES:
        report.refuse("conversion.extra", extra.at("role"), f"unknown role {role!r}")
    return ItemExtra(
        pointer=extra.pointer,
        id=extra.typed("id", str, required=False) or "",
        role=role,
        fields=extra.typed("fields", dict, required=False),
        written=extra.typed("written", dict, required=False),
    )


_GENERIC: Final = 0
"""MAV_TYPE_GENERIC: the file leaves the vehicle open."""
_VTOL_ONLY: Final = frozenset({MavCmd.NAV_VTOL_TAKEOFF, MavCmd.NAV_VTOL_LAND, MavCmd.DO_VTOL_TRANSITION})


@dataclass(frozen=True, slots=True)
class Unsaid:
    """What the caller specifies for missing fields."""

    name: str = "Imported mission"
    vehicle_type: VehicleType | None = None


def read_qgc(document: Mapping[str, Any], unsaid: Unsaid, report: Report) -> PlanDraft:
    """The draft; errors are in the report. `document` is checked JSON data."""
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
        message = f"MAV_TYPE {number} is not a vehicle type that Waydrop supports"
        report.refuse("conversion.vehicle_type", mission.at("vehicleType"), message)
    return unsaid.vehicle_type or guess_vehicle_type(items, mission.at("vehicleType"), report)


def guess_vehicle_type(items: list[FileItem], pointer: str, report: Report) -> VehicleType:
    """From the commands: VTOL ones are for VTOLs alone, everything else a multicopter may fly."""
    guess = VehicleType.MULTICOPTER
    if any(item.command in _VTOL_ONLY for item in items):
        guess = VehicleType.VTOL
    message = f"the file has no vehicle type; {guess} is assumed from its items"
    report.assume("conversion.vehicle_type", pointer, message, "specify the vehicle type in the request")
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
        message = "the planned home position is incomplete, so the plan has none"
        report.lose("conversion.home", pointer, message, "the home of the vehicle is used once it is known")
    else:
        draft.fields["home"] = dict(zip(names, home, strict=True))


def _name_planning_speeds(mission: FileObject, usual: Mapping[str, float], report: Report) -> None:
    """cruiseSpeed and hoverSpeed are never sent to a vehicle: as a plan's speeds they would be."""
    for key in ("cruiseSpeed", "hoverSpeed"):
        speed_m_s = mission.number(key, required=False)
        if speed_m_s is not None and speed_m_s != usual[key]:
            message = (
                f"{key} {speed_m_s:g} is only used for estimates in QGroundControl and is never sent: the plan omits it"
            )
            hint = "set cruise_speed_m_s in the plan to fly at this speed"
            report.lose("conversion.planning_speed", mission.at(key), message, hint)
