"""The landing patterns of a .plan, taken apart into the mission items that QGroundControl sends for them."""

from __future__ import annotations

from typing import Final

from app.domain.mission import MavCmd, MavFrame
from app.interchange.file_item import FileItem
from app.interchange.file_json import FileObject
from app.interchange.findings import Report
from app.interchange.qgc_format import LANDING_KEYS

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
            message = f"the end of taking {what} is lost: a plan has no camera items"
            report.lose("conversion.camera", item.at(key), message)
    if item.value.get("useDoChangeSpeed") is True:
        message = "the speed of the final approach is lost"
        report.lose("conversion.parameter", item.at("useDoChangeSpeed"), message, "put a change_speed item before")
    item.name_unknown(LANDING_KEYS)
