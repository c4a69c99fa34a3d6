"""The landing of a fixed wing in a file: DO_LAND_START, NAV_LOITER_TO_ALT, NAV_LAND are one item of a plan."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from app.domain.items.form import CommandForm, Param
from app.domain.mission import MavCmd
from app.interchange.file_item import FileItem
from app.interchange.findings import Report
from app.interchange.item_draft import ItemDraft, read_draft

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
        message = "the file has no circle on which to descend before this landing; Waydrop adds one"
        hint = "put NAV_LOITER_TO_ALT (31) before it to say where"
        report.assume("conversion.approach", land.pointer, message, hint)
        return
    if not any(item.command == MavCmd.DO_LAND_START for item in before):
        message = "the file does not mark where the landing begins; Waydrop puts DO_LAND_START there"
        report.assume("conversion.land_start", circle.pointer, message)
    if (circle.param(1), circle.param(4)) != (1.0, _TANGENT):
        message = "Waydrop leaves this circle towards the landing, on the tangent; the file says otherwise"
        report.lose("conversion.approach_exit", circle.pointer, message)
    _take(land, circle, report)


def name_lost_start(item: FileItem, report: Report) -> None:
    """A DO_LAND_START for which a plan has no place: only a fixed wing's landing has one."""
    message = "DO_LAND_START (189) is lost: a return of this vehicle does not join the landing here"
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
