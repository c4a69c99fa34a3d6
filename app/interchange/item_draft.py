"""One item of a file as the fields of a plan item, each with its place in the file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from app.domain.items import FORMS
from app.domain.items.base import CommandForm, Param
from app.domain.mission import MavCmd, MavFrame
from app.interchange.findings import Report

PLAN_COLUMNS: Final = tuple(f"/params/{index}" for index in range(7))
TEXT_COLUMNS: Final = ("/param1", "/param2", "/param3", "/param4", "/latitude", "/longitude", "/altitude")


@dataclass(frozen=True, slots=True)
class ItemExtra:
    """The `waydrop` object of an item: fields that the file format lacks.

    `fields` are fields of the plan item. `written` has the values in the format's own fields that replace some of them:
    if such a value was edited, the edit is used and `fields` is outdated. `role` is set on items that are no plan item
    of their own: `speed` and `pause` belong to the next one, `cruise_speed` and `wait` to the previous one.
    """

    pointer: str
    id: str = ""
    role: str = ""
    fields: Mapping[str, Any] | None = None
    written: Mapping[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class FileItem:
    """One MISSION_ITEM: MAV_CMD, MAV_FRAME, param1 to param7. None is "not given", NaN on the wire.

    `number` is its number for DO_JUMP. `columns` are the locations of the parameters below `pointer`.
    """

    command: int
    frame: int
    params: tuple[float | None, ...]
    number: int
    pointer: str
    columns: tuple[str, ...] = PLAN_COLUMNS
    extra: ItemExtra | None = None

    def param(self, number: int) -> float | None:
        return self.params[number - 1]

    def at(self, number: int) -> str:
        return self.pointer + self.columns[number - 1]


CAMERA_ONLY: Final = frozenset(
    {
        MavCmd.DO_SET_ROI_LOCATION,
        MavCmd.DO_SET_ROI_WPNEXT_OFFSET,
        MavCmd.DO_SET_ROI_NONE,
        MavCmd.DO_SET_ROI_SYSID,
        MavCmd.DO_SET_ROI,
        MavCmd.DO_DIGICAM_CONFIGURE,
        MavCmd.DO_DIGICAM_CONTROL,
        MavCmd.DO_MOUNT_CONFIGURE,
        MavCmd.DO_MOUNT_CONTROL,
        MavCmd.DO_SET_CAM_TRIGG_DIST,
        MavCmd.DO_SET_CAM_TRIGG_INTERVAL,
        MavCmd.SET_CAMERA_MODE,
        MavCmd.SET_CAMERA_ZOOM,
        MavCmd.SET_CAMERA_FOCUS,
        MavCmd.SET_CAMERA_SOURCE,
        MavCmd.DO_GIMBAL_MANAGER_PITCHYAW,
        MavCmd.DO_GIMBAL_MANAGER_CONFIGURE,
        MavCmd.IMAGE_START_CAPTURE,
        MavCmd.IMAGE_STOP_CAPTURE,
        MavCmd.DO_TRIGGER_CONTROL,
        MavCmd.VIDEO_START_CAPTURE,
        MavCmd.VIDEO_STOP_CAPTURE,
    }
)
"""Commands for a camera or a gimbal: without them the flight and its drops are the same."""

HINTS: Final = {
    80: "Waydrop does not turn cameras: remove the item",
    94: "use a land item with a gripper item after it",
    112: "use NAV_DELAY, which corresponds to a delay item",
    183: "use DO_GRIPPER or DO_WINCH, whose outcome Waydrop can determine",
    187: "use DO_GRIPPER or DO_WINCH, whose outcome Waydrop can determine",
    30002: "use DO_GRIPPER or DO_WINCH, whose outcome Waydrop can determine",
}


def command_name(command: int) -> str:
    """`NAV_WAYPOINT (16)`, or the bare number of one that is not known."""
    try:
        return f"{MavCmd(command).name} ({command})"
    except ValueError:
        return f"the command {command}"


RELATIVE: Final = frozenset({MavFrame.GLOBAL_RELATIVE_ALT, MavFrame.GLOBAL_RELATIVE_ALT_INT})
ABSOLUTE: Final = frozenset({MavFrame.GLOBAL, MavFrame.GLOBAL_INT})
FRAMES: Final = RELATIVE | ABSOLUTE | {MavFrame.MISSION}
_TERRAIN: Final = frozenset({10, 11})


@dataclass(slots=True)
class ItemDraft:
    """`fields` are those of a plan item (no `id` yet), `places` their pointers, `numbers` the numbers of the file's
    items that became this one.

    `jump_to` is the number of a jump's target. `motion_assumed`: the file does not specify whether the vehicle stops
    for the drop.
    """

    type: str
    pointer: str
    fields: dict[str, Any] = field(default_factory=dict)
    places: dict[str, str] = field(default_factory=dict)
    numbers: list[int] = field(default_factory=list)
    jump_to: float | None = None
    id: str = ""
    motion_assumed: bool = False


def read_draft(item: FileItem, form: CommandForm, report: Report) -> ItemDraft:
    """The fields from the parameters of the item. Values out of range are found when the plan is validated."""
    draft = ItemDraft(form.type, item.pointer, dict(form.fixed), numbers=[item.number])
    for name, param in form.params.items():
        _read_param(draft, item, name, param, report)
    if form.positioned:
        _read_place(draft, item, report)
    name_what_is_lost(item, form.used(), form.neutral, report)
    return draft


def name_what_is_lost(
    item: FileItem, used: frozenset[int], neutral: Mapping[int, tuple[float, ...]], report: Report
) -> None:
    """Parameters that say something for which a plan item has no field."""
    for number in range(1, 8):
        value = item.param(number)
        if number in used or value is None or value == 0 or value in neutral.get(number, ()):
            continue
        report.lose(
            "conversion.parameter",
            item.at(number),
            f"param{number} of {command_name(item.command)} is {value:g}, which a plan has no field for",
        )


def _read_param(draft: ItemDraft, item: FileItem, name: str, param: Param, report: Report) -> None:
    value = item.param(param.number)
    if value is None or (param.zero_is_none and value == 0):
        if param.words is not None and name != "speed_type":
            message = f"{command_name(item.command)} has no {name}"
            report.refuse("conversion.missing", item.at(param.number), message, _choices(param))
        return
    given: Any = value
    if param.words is not None:
        if value not in param.words:
            message = f"{value:g} is no {name} of {command_name(item.command)}"
            report.refuse("conversion.bad_parameter", item.at(param.number), message, _choices(param))
            return
        given = param.words[value]
    elif param.whole:
        if not value.is_integer():
            message = f"{value:g} is not an integer"
            report.refuse("conversion.bad_parameter", item.at(param.number), message)
            return
        given = int(value)
    draft.fields[name] = given
    draft.places[name] = item.at(param.number)


def _choices(param: Param) -> str:
    return "give one of " + ", ".join(f"{number:g} ({word})" for number, word in (param.words or {}).items())


def _read_place(draft: ItemDraft, item: FileItem, report: Report) -> None:
    altitude = "absolute_altitude_m" if item.frame in ABSOLUTE else "relative_altitude_m"
    if not is_placed(item, report):
        return
    for number, name in ((5, "latitude_deg"), (6, "longitude_deg"), (7, altitude)):
        value = item.param(number)
        draft.places[name] = item.at(number)
        if value is not None:
            draft.fields[name] = value
        elif number == 7 or item.command not in (MavCmd.NAV_TAKEOFF, MavCmd.NAV_VTOL_TAKEOFF):
            message = f"{command_name(item.command)} has no {name.split('_')[-2]}"
            report.refuse("conversion.missing", item.at(number), message, "specify it; a plan requires every position")


def is_placed(item: FileItem, report: Report) -> bool:
    """Whether the altitude's reference is one that a plan has."""
    if item.frame in RELATIVE | ABSOLUTE:
        return True
    if item.frame in _TERRAIN:
        message = "the altitude is above terrain, which PX4 does not support in missions"
    else:
        message = f"{command_name(item.command)} has an altitude in MAV_FRAME {item.frame}"
    report.refuse("conversion.frame", item.pointer, message, "use frame 3 (above home) or 0 (above mean sea level)")
    return False


def form_of(item: FileItem) -> CommandForm | None:
    """The form of an item's command, None if no plan item is made of it."""
    return FORMS.get(item.command)
