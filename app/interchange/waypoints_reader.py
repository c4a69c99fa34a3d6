"""The waypoint text of Mission Planner and of QGroundControl's older versions (`QGC WPL`) to the fields of a plan.

One item a line, twelve columns: index, current, frame, command, param1 to param7, autocontinue. In version 110 item 0
is the home position. Blank lines and comments (#) count for nothing. Pointers are
`/<line>/<column>`, lines counted from 1 as editors count them.
"""

from __future__ import annotations

import math
import re
from typing import Final

from app.domain.mission import MavCmd
from app.domain.plan.json_tree import MAX_ITEMS
from app.domain.validation.finding import json_pointer
from app.interchange.findings import Report
from app.interchange.item_draft import ABSOLUTE, TEXT_COLUMNS, FileItem, form_of
from app.interchange.item_reader import ItemReader, without_zero_yaws
from app.interchange.plan_draft import PlanDraft
from app.interchange.qgc_reader import Unsaid, guess_vehicle_type

HEADER: Final = "QGC WPL"
_HOME_FIRST, _NO_HOME = 110, 120
_COLUMNS: Final = ("index", "current", "frame", "command", *(name[1:] for name in TEXT_COLUMNS), "autocontinue")
_WHOLE_COLUMNS: Final = tuple(
    (place, name)
    for place, name in enumerate(_COLUMNS)
    if name in ("index", "current", "frame", "command", "autocontinue")
)
_LINE_END: Final = re.compile(r"\r\n|\n|\r")
"""What ends a line for editors too; splitlines() also splits at U+2028, U+0085 and vertical tabs."""
_WHOLE: Final = re.compile(r"[+-]?\d{1,9}(\.0*)?")
_NUMBER: Final = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


def read_waypoints(text: str, unsaid: Unsaid, report: Report) -> PlanDraft:
    """The draft; errors are in the report."""
    lines = _LINE_END.split(text)
    version = _version(lines[0], report)
    draft = PlanDraft({"version": 1, "name": unsaid.name})
    if len(lines) > 2 * MAX_ITEMS:
        report.refuse("conversion.too_large", "", f"{len(lines)} lines; a plan has at most {MAX_ITEMS} items")
        return draft
    written = [(number, line) for number, line in enumerate(lines[1:], start=2) if line.strip()]
    comments = [number for number, line in written if _is_comment(line)]
    if comments:
        message = f"a plan cannot contain comments: this one and {len(comments) - 1} more are omitted"
        report.lose("conversion.comment", f"/{comments[0]}", message)
    written = [(number, line) for number, line in written if not _is_comment(line)]
    read = [_read_line(line, number, index, report) for index, (number, line) in enumerate(written)]
    items = [item for item in read if item is not None]
    if items and version == _HOME_FIRST:
        items = _take_home(items, draft, report)
    for item in items:
        _refuse_open_place(item, report)
    kind = unsaid.vehicle_type or guess_vehicle_type(items, "", report)
    draft.fields["vehicle_type"] = kind.value
    reader = ItemReader(kind, report)
    reader.read(without_zero_yaws(items, "", report))
    draft.items = reader.drafts
    return draft


def _is_comment(line: str) -> bool:
    """As MAVProxy and pymavlink have them."""
    return line.lstrip().startswith("#")


def _version(header: str, report: Report) -> int:
    found = re.fullmatch(r"QGC WPL\s+(\d{1,9})\s*", header)
    version = int(found.group(1)) if found else 0
    if version not in (_HOME_FIRST, _NO_HOME):
        message = f'the first line must be "{HEADER} {_HOME_FIRST}"'
        report.refuse("conversion.version", "/1", message, "save the file again in Mission Planner or QGroundControl")
    return version


def _read_line(line: str, number: int, index: int, report: Report) -> FileItem | None:
    columns = line.split()
    pointer = f"/{number}"
    if len(columns) != len(_COLUMNS):
        message = f"a line has {len(_COLUMNS)} columns, this one has {len(columns)}"
        report.refuse("conversion.columns", pointer, message)
        return None
    whole = {name: _whole(columns[place], f"{pointer}/{name}", report) for place, name in _WHOLE_COLUMNS}
    params = [_number(text, pointer + name, report) for text, name in zip(columns[4:11], TEXT_COLUMNS, strict=True)]
    given, frame, command = whole["index"], whole["frame"], whole["command"]
    if given is not None and given != index:
        report.refuse("conversion.order", f"{pointer}/index", f"the index is {given}, but its position is {index}")
    if whole["autocontinue"] == 0:
        message = "the mission waits after this item until it is advanced; a plan has no such item"
        report.refuse("conversion.auto_continue", f"{pointer}/autocontinue", message, "use a delay")
    if frame is None or command is None:
        return None
    return FileItem(command, frame, tuple(params), index, pointer, TEXT_COLUMNS)


def _whole(text: str, pointer: str, report: Report) -> int | None:
    if _WHOLE.fullmatch(text):
        return int(float(text))
    report.refuse("conversion.wrong_type", pointer, f"{text[:40]!r} is not an integer")
    return None


def _number(text: str, pointer: str, report: Report) -> float | None:
    """NaN is "not given", as on the wire."""
    if text.lower() == "nan":
        return None
    value = float(text) if _NUMBER.fullmatch(text) else math.nan
    if math.isfinite(value):
        return value
    report.refuse("conversion.wrong_type", pointer, f"{text[:40]!r} is not a valid number")
    return None


def _take_home(items: list[FileItem], draft: PlanDraft, report: Report) -> list[FileItem]:
    """Line 0 is where the vehicle started, and no item: flown, it would lead underground."""
    home = items[0]
    if home.command != MavCmd.NAV_WAYPOINT or home.frame not in ABSOLUTE:
        message = "the first item should be the home position (command 16, frame 0); it is read as an item"
        report.assume("conversion.home", home.pointer, message)
        return items
    latitude, longitude, altitude = home.params[4:7]
    if None in (latitude, longitude, altitude) or latitude == longitude == 0:
        message = "the file has no home position, so the plan has none"
        report.lose("conversion.home", home.pointer, message, "the home of the vehicle is used once it is known")
        return items[1:]
    names = ("latitude_deg", "longitude_deg", "absolute_altitude_m")
    draft.fields["home"] = dict(zip(names, home.params[4:7], strict=True))
    draft.places |= {json_pointer("home", name): home.at(number) for number, name in enumerate(names, start=5)}
    return items[1:]


def _refuse_open_place(item: FileItem, report: Report) -> None:
    """0, 0 in these files is "where the vehicle is then": a plan says where."""
    form = form_of(item)
    if form is not None and form.positioned and form.type != "takeoff" and item.param(5) == item.param(6) == 0:
        message = "0, 0 means the current position of the vehicle; a plan requires every position"
        report.refuse("conversion.missing", item.at(5), message, "write the coordinates out")
