"""A list of mission items to a list of plan items: helpers folded in, landings recognised, jumps resolved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from app.domain.items import FORMS
from app.domain.items.base import CommandForm, Param
from app.domain.mission import MavCmd
from app.domain.vehicle.state import VehicleType
from app.interchange.findings import Report
from app.interchange.item_draft import (
    CAMERA_ONLY,
    FRAMES,
    HINTS,
    FileItem,
    ItemDraft,
    command_name,
    form_of,
    read_draft,
)
from app.interchange.plan_draft import apply_item_extra

# A yaw of 0 in files that cannot express "not given": read as north, it would turn the vehicle.


def without_zero_yaws(items: Sequence[FileItem], pointer: str, report: Report) -> list[FileItem]:
    """Return the items without a yaw (param4) of 0; reported once per file."""
    if any(_is_zero_yaw(item) for item in items):
        message = "a yaw (param4) of 0 is read as not specified, because such files cannot express it otherwise"
        report.assume("conversion.yaw", pointer, message)
    return [_without(item) if _is_zero_yaw(item) else item for item in items]


def _is_zero_yaw(item: FileItem) -> bool:
    form = FORMS.get(item.command)
    return form is not None and "yaw_deg" in form.params and item.param(4) == 0


def _without(item: FileItem) -> FileItem:
    return replace(item, params=(*item.params[:3], None, *item.params[4:]))


_APPROACH: Final = CommandForm("approach", {"radius_m": Param(2)}, positioned=True, neutral={1: (1.0,), 4: (1.0,)})
_TANGENT: Final = 1.0


def begins_landing(item: FileItem, following: FileItem | None) -> bool:
    """Whether this NAV_LOITER_TO_ALT is the approach of the NAV_LAND after it."""
    return item.command == MavCmd.NAV_LOITER_TO_ALT and following is not None and following.command == MavCmd.NAV_LAND


def fold_approach(land: ItemDraft, before: Sequence[FileItem], report: Report) -> None:
    """Put the approach into a fixed wing's land item."""
    land.numbers = [item.number for item in before] + land.numbers
    circle = next((item for item in before if item.command == MavCmd.NAV_LOITER_TO_ALT), None)
    if circle is None:
        message = "the file has no loiter to descend before this landing; Waydrop adds one"
        hint = "insert NAV_LOITER_TO_ALT (31) before it to define its position"
        report.assume("conversion.approach", land.pointer, message, hint)
        return
    if not any(item.command == MavCmd.DO_LAND_START for item in before):
        message = "the file does not mark the start of the landing; Waydrop inserts DO_LAND_START"
        report.assume("conversion.land_start", circle.pointer, message)
    if (circle.param(1), circle.param(4)) != (1.0, _TANGENT):
        message = "Waydrop leaves this loiter on the tangent towards the landing; the file specifies otherwise"
        report.lose("conversion.approach_exit", circle.pointer, message)
    _take(land, circle, report)


def name_lost_start(item: FileItem, report: Report) -> None:
    """A DO_LAND_START for which a plan has no place: only a fixed wing's landing has one."""
    message = "DO_LAND_START (189) is omitted: a return of this vehicle does not use this landing"
    report.lose("conversion.land_start", item.pointer, message)


def _take(land: ItemDraft, circle: FileItem, report: Report) -> None:
    read = read_draft(circle, _APPROACH, report)
    approach: dict[str, Any] = read.fields
    if "radius_m" not in approach:
        message = "the circle has no radius; 60 m clockwise is assumed"
        report.assume("conversion.approach", circle.at(2), message)
        approach["radius_m"] = 60.0
    land.fields["approach"] = approach
    land.places["approach"] = circle.pointer
    land.places |= {f"approach/{name}": place for name, place in read.places.items()}


_DROPS: Final = frozenset({"gripper", "winch"})
_NO_CHANGE: Final = -1.0


@dataclass(slots=True)
class ItemReader:
    """Reads one list. `drafts` in flying order; `cruise_speed_m_s` if an item set it for the whole flight."""

    vehicle_type: VehicleType
    report: Report
    drafts: list[ItemDraft] = field(default_factory=list)
    cruise_speed_m_s: float | None = None
    _speeds: list[FileItem] = field(default_factory=list)
    """Speeds that Waydrop wrote before the waypoint that they belong to."""
    _landing: list[FileItem] = field(default_factory=list)
    """DO_LAND_START and the approach of a landing that comes next."""
    _skipped: list[int] = field(default_factory=list)
    """Numbers of removed items: a jump to one goes to the following item."""

    def read(self, items: Sequence[FileItem]) -> None:
        for item, following in zip(items, _next_flown(items), strict=True):
            self._read_one(item, following)
        self._put_back_speeds()
        self._give_up_landing()
        self._name_jump_targets()

    def _read_one(self, item: FileItem, following: FileItem | None) -> None:
        form = form_of(item)
        if item.frame not in FRAMES and (form is None or not form.positioned):
            message = f"{command_name(item.command)} is in MAV_FRAME {item.frame}"
            self.report.refuse("conversion.frame", item.pointer, message, "use frame 2 for items without a position")
        if item.command == MavCmd.DO_LAND_START or (
            self.vehicle_type is VehicleType.FIXED_WING and begins_landing(item, following)
        ):
            self._landing.append(item)
        elif form is None and item.command in CAMERA_ONLY:
            message = (
                f"{command_name(item.command)} is a camera command: a plan has no such item; the flight is the same"
            )
            self._skip("conversion.camera", item, message)
        elif form is None:
            message = f"there is no plan item for {command_name(item.command)}"
            self.report.refuse("conversion.command", item.pointer, message, HINTS.get(item.command, ""))
        elif item.command == MavCmd.DO_CHANGE_SPEED and item.param(2) == _NO_CHANGE:
            self._skip("conversion.no_change", item, "this DO_CHANGE_SPEED (178) to -1 has no effect")
        elif item.command == MavCmd.DO_JUMP and item.param(2) == 0:
            self._skip("conversion.no_change", item, "this DO_JUMP (177) has no repetitions")
        elif not self._is_helper(item):
            self._add(item, read_draft(item, form, self.report))

    def _skip(self, code: str, item: FileItem, message: str) -> None:
        self.report.lose(code, item.pointer, message)
        self._skipped.append(item.number)

    def _is_helper(self, item: FileItem) -> bool:
        """An item that Waydrop itself wrote to go with another one."""
        role = item.extra.role if item.extra is not None else ""
        if role == "speed" and item.command == MavCmd.DO_CHANGE_SPEED:
            self._speeds.append(item)
            return True
        speed_m_s = item.param(2)
        if role == "cruise_speed" and item.command == MavCmd.DO_CHANGE_SPEED and speed_m_s is not None:
            if self.cruise_speed_m_s not in (None, speed_m_s):
                return False
            self.cruise_speed_m_s = speed_m_s
            return self._goes_with_last(item)
        if role in ("pause", "wait") and item.command == MavCmd.NAV_DELAY and item.extra is not None:
            if (item.extra.written or {}).get("duration_s") != item.param(1):
                return False
            return self._goes_with_last(item) if role == "wait" else self._goes_with_next(item)
        return False

    def _goes_with_next(self, item: FileItem) -> bool:
        self._skipped.append(item.number)
        return True

    def _goes_with_last(self, item: FileItem) -> bool:
        if not self.drafts:
            return self._goes_with_next(item)
        self.drafts[-1].numbers.append(item.number)
        return True

    def _add(self, item: FileItem, draft: ItemDraft) -> None:
        if draft.type == "waypoint":
            self._take_speed(draft)
        self._put_back_speeds()
        if draft.type == "jump":
            draft.jump_to = item.param(1)
            draft.places["jump"] = item.at(1)
            draft.fields.pop("target", None)
        elif draft.type == "takeoff":
            self._read_takeoff(item, draft)
        elif draft.type == "change_speed" and "speed_type" not in draft.fields:
            message = "the file has no speed type; airspeed is assumed for a fixed wing, otherwise ground speed"
            self.report.assume("conversion.speed_type", item.at(1), message)
        elif draft.type == "land":
            self._read_land(item, draft)
        self._give_up_landing()
        if item.extra is not None and not item.extra.role:
            apply_item_extra(draft, item.extra, self.report)
        if draft.type in _DROPS:
            self._read_drop(item, draft)
        self._append(draft)

    def _append(self, draft: ItemDraft) -> None:
        draft.numbers += self._skipped
        self._skipped = []
        self.drafts.append(draft)

    def _read_takeoff(self, item: FileItem, draft: ItemDraft) -> None:
        """(0, 0) is no runway: files that take off at the current position have it."""
        here = draft.fields.get("latitude_deg") == 0 == draft.fields.get("longitude_deg")
        if here and (item.extra is None or not item.extra.id):
            del draft.fields["latitude_deg"], draft.fields["longitude_deg"]
        if self.vehicle_type is not VehicleType.FIXED_WING and draft.fields.get("pitch_deg") == 0:
            del draft.fields["pitch_deg"]  # nothing else climbs at an angle
        elif self.vehicle_type is VehicleType.FIXED_WING and "pitch_deg" not in draft.fields:
            message = "the file has no climb angle; 15 degrees are assumed"
            self.report.assume("conversion.pitch", item.at(1), message)
        if item.command == MavCmd.NAV_TAKEOFF and self.vehicle_type is VehicleType.VTOL:
            message = "NAV_TAKEOFF of a VTOL ends in hover; the takeoff of a plan includes the transition"
            self.report.refuse("conversion.vtol_takeoff", item.pointer, message, "use NAV_VTOL_TAKEOFF (84)")
        elif item.command == MavCmd.NAV_VTOL_TAKEOFF and self.vehicle_type is not VehicleType.VTOL:
            message = f"NAV_VTOL_TAKEOFF is read as the takeoff of a {self.vehicle_type}"
            self.report.assume("conversion.vtol_command", item.pointer, message)

    def _read_land(self, item: FileItem, draft: ItemDraft) -> None:
        is_vtol = self.vehicle_type is VehicleType.VTOL
        if (item.command == MavCmd.NAV_VTOL_LAND) != is_vtol:
            message = f"{command_name(item.command)} is read as the landing of a {self.vehicle_type}"
            self.report.assume("conversion.vtol_command", item.pointer, message)
        if self.vehicle_type is VehicleType.FIXED_WING:
            fold_approach(draft, self._landing, self.report)
            self._landing = []

    def _give_up_landing(self) -> None:
        """DO_LAND_START with no landing of a fixed wing right after it."""
        for item in self._landing:
            name_lost_start(item, self.report)
            self._skipped.append(item.number)
        self._landing = []

    def _take_speed(self, waypoint: ItemDraft) -> None:
        """The speed right before a waypoint, if it is one that the compiler would write for it."""
        if not self._speeds or self._speeds[-1].param(1) != speed_kind(self.vehicle_type):
            return
        item = self._speeds.pop()
        waypoint.fields["speed_m_s"] = item.param(2)
        waypoint.places["speed_m_s"] = item.at(2)
        waypoint.numbers.insert(0, item.number)

    def _put_back_speeds(self) -> None:
        """Speeds whose waypoint was removed: items of their own."""
        for item in self._speeds:
            self._append(read_draft(item, FORMS[MavCmd.DO_CHANGE_SPEED], self.report))
        self._speeds = []

    def _read_drop(self, item: FileItem, draft: ItemDraft) -> None:
        if "instance" not in draft.fields:
            message = f"{command_name(item.command)} has no instance; the first one is assumed"
            self.report.assume("conversion.instance", item.at(1), message)
        if "release_motion" not in draft.fields:
            draft.motion_assumed = True
            draft.fields["release_motion"] = "stopped"

    def _name_jump_targets(self) -> None:
        """Jumps point at numbers of the file, plan items at ids."""
        owners: dict[float, list[int]] = {}
        for index, draft in enumerate(self.drafts):
            for number in draft.numbers:
                owners.setdefault(float(number), []).append(index)
        taken = {draft.id for draft in self.drafts}
        for draft in self.drafts:
            if draft.type != "jump" or "target" in draft.fields:
                continue
            found = owners.get(draft.jump_to, []) if draft.jump_to is not None else []
            if len(found) != 1:
                self.report.refuse("conversion.jump", draft.places["jump"], _unclear_jump(draft.jump_to, len(found)))
                continue
            index = found[0]
            target = self.drafts[index]
            target.id = target.id or _free_id(index + 1, taken)
            draft.fields["target"] = target.id


def _unclear_jump(number: float | None, owners: int) -> str:
    if number is None:
        return "the jump has no target item"
    return f"the jump goes to number {number:g}, which {'several items have' if owners else 'no item has'}"


def _next_flown(items: Sequence[FileItem]) -> list[FileItem | None]:
    """For each item the one after it that is not omitted as a camera command: a photo is a plan item."""
    found: list[FileItem | None] = []
    following: FileItem | None = None
    for item in reversed(items):
        found.append(following)
        following = following if item.command in CAMERA_ONLY and form_of(item) is None else item
    return found[::-1]


def speed_kind(vehicle_type: VehicleType) -> float:
    """param1 of DO_CHANGE_SPEED as the compiler writes it for a waypoint's speed."""
    return 0.0 if vehicle_type is VehicleType.FIXED_WING else 1.0


def _free_id(number: int, taken: set[str]) -> str:
    """The ID that a plan would assign, so that jumps can refer to it."""
    name = f"item-{number}"
    while name in taken:
        name += "x"
    taken.add(name)
    return name
