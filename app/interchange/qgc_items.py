"""The items of a .plan as mission items: simple ones as they are, landing patterns taken apart, surveys refused."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from app.domain.plan.size_limits import MAX_ITEMS
from app.interchange.file_item import FileItem, ItemExtra
from app.interchange.file_json import FileObject, is_number
from app.interchange.findings import Report
from app.interchange.item_draft import ABSOLUTE, RELATIVE
from app.interchange.qgc_format import (
    ALTITUDE_ABOVE_TERRAIN,
    ALTITUDE_ABSOLUTE,
    ALTITUDE_RELATIVE,
    EXTRA,
    ITEM_KEYS,
)
from app.interchange.qgc_landing import LANDINGS, landing_items

MAX_FILE_ITEMS: Final = 4 * MAX_ITEMS
"""A drop or a landing that Waydrop writes is three items, a waypoint with a speed two."""
_ROLES: Final = ("speed", "pause", "cruise_speed", "wait")
_EXTRA_KEYS: Final = frozenset({"id", "role", "fields", "written"})
_SAME_M: Final = 0.01
_OTHER_REFERENCE: Final = {ALTITUDE_RELATIVE: ABSOLUTE, ALTITUDE_ABSOLUTE: RELATIVE}


def read_qgc_items(items: Sequence[Any], pointer: str, altitude_mode: int | None, report: Report) -> list[FileItem]:
    """All mission items that the file stands for, in order; what cannot be read is refused and left out.

    A file of more than MAX_FILE_ITEMS is refused before any is looked at.
    """
    if len(items) > MAX_FILE_ITEMS:
        report.refuse("conversion.too_large", pointer, f"{len(items)} items; a plan has at most {MAX_ITEMS}")
        return []
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
            report.refuse("conversion.item_type", item.at("type"), f"there is no item type {kind!r}")
    return found


def _complex(item: FileObject, number: int, report: Report) -> list[FileItem]:
    kind = item.typed("complexItemType", str)
    if kind in LANDINGS:
        return landing_items(item, number, report)
    if kind is not None:
        message = f"the complex item {kind!r} stands for items that only QGroundControl can work out"
        hint = "a delivery plan has no surveys; take it away, or convert it to simple items"
        report.refuse("conversion.complex_item", item.at("complexItemType"), message, hint)
    return []


def _simple(item: FileObject, number: int, altitude_mode: int | None, report: Report) -> FileItem | None:
    command, frame = item.whole("command"), item.whole("frame")
    params = item.numbers("params", 7)
    jump_id = item.whole("doJumpId", required=False)
    if item.typed("autoContinue", bool) is False:
        message = "after this item the mission waits until somebody moves it on; a plan has no such item"
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
        message = "the altitude was computed from a height above terrain; the plan has the altitude alone"
        report.lose("conversion.above_terrain", item.at("AltitudeMode"), message)
    elif shown_m is not None and given_m is not None and abs(shown_m - given_m) > _SAME_M:
        message = f"Altitude says {shown_m:g} m; {given_m:g} m is taken (param7), as QGroundControl would send it"
        report.assume("conversion.two_altitudes", item.at("Altitude"), message, "make them equal if that is not meant")
    elif "AltitudeMode" in item.value and frame in _OTHER_REFERENCE.get(mode or 0, ()):
        message = f"AltitudeMode {mode} is not that of frame {frame}, which is taken, as QGroundControl would send it"
        hint = "make them agree if that is not meant"
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
        report.refuse("conversion.extra", extra.at("role"), f"there is no role {role!r}")
    return ItemExtra(
        pointer=extra.pointer,
        id=extra.typed("id", str, required=False) or "",
        role=role,
        fields=extra.typed("fields", dict, required=False),
        written=extra.typed("written", dict, required=False),
    )
