"""A large file costs no more than its size, and what is said of it stays readable."""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Iterator
from typing import Any

import pytest

from app.domain.plan import Plan, parse_plan
from app.domain.plan.json_tree import MAX_ITEMS
from app.domain.vehicle.state import VehicleType
from app.interchange.findings import MAX_LISTED, ConversionRefused, FindingKind, Report
from app.interchange.formats import TargetFormat, convert_to_plan, export_plan
from app.interchange.item_draft import FileItem
from app.interchange.item_reader import ItemReader
from app.interchange.qgc_outline import MAX_FILE_ITEMS
from tests.support.interchange_files import document

GOOD = document("multicopter-delivery.plan")
CAMERA, LOITER_TO_ALT = 2001, 31


def simple(command: int) -> dict[str, Any]:
    return {"type": "SimpleItem", "autoContinue": True, "command": command, "frame": 2, "params": [0] * 7}


def with_items(*items: Any) -> bytes:
    plan = copy.deepcopy(GOOD)
    plan["mission"]["items"] += items
    return json.dumps(plan).encode()


def test_a_file_of_far_too_many_items_is_refused_with_one_finding_and_not_read() -> None:
    unreadable = [7] * (MAX_FILE_ITEMS + 1)
    with pytest.raises(ConversionRefused) as refused:
        convert_to_plan(with_items(*unreadable))
    (finding,) = refused.value.findings
    assert (finding.code, finding.pointer) == ("conversion.too_large", "/mission/items")


def _fence(*polygons: Any, circles: int = 0) -> dict[str, Any]:
    return {"version": 2, "polygons": list(polygons), "circles": [{}] * circles}


FAR_TOO_LONG: dict[str, tuple[dict[str, Any], str]] = {
    "rally points": ({"rallyPoints": {"version": 2, "points": [{}] * 1000}}, "/rallyPoints/points"),
    "polygons": ({"geoFence": _fence(*[{}] * 1000)}, "/geoFence/polygons"),
    "circles": ({"geoFence": _fence(circles=1000)}, "/geoFence/circles"),
    "vertices": ({"geoFence": _fence({}, {"polygon": [{}] * 2000})}, "/geoFence/polygons/1/polygon"),
    "fields": ({"waydrop": {"version": 1, "fields": {f"f{n}": 0 for n in range(1000)}}}, "/waydrop/fields"),
}


@pytest.mark.parametrize("what", FAR_TOO_LONG)
def test_a_list_that_no_plan_has_is_refused_with_one_finding(what: str) -> None:
    changes, pointer = FAR_TOO_LONG[what]
    with pytest.raises(ConversionRefused) as refused:
        convert_to_plan(json.dumps(GOOD | changes).encode())
    (finding,) = refused.value.findings
    assert (finding.code, finding.pointer) == ("conversion.too_large", pointer)


@pytest.mark.parametrize(
    ("document", "code"),
    [
        (GOOD | FAR_TOO_LONG["rally points"][0], "conversion.too_large"),
        ({"items": [], "rally_points": [{}] * 2000}, "plan.too_many_items"),
    ],
    ids=["a .plan", "a plan"],
)
def test_a_list_that_is_far_too_long_is_refused_before_anything_is_copied(document: dict[str, Any], code: str) -> None:
    """To copy takes long. A copy would find the number that is none."""
    with pytest.raises(ConversionRefused) as refused:
        convert_to_plan(json.dumps(document | {"far": math.nan}).encode())
    assert [finding.code for finding in refused.value.findings] == [code]


def test_the_longest_plan_of_drops_and_speeds_comes_back_from_its_own_file() -> None:
    way = {"type": "waypoint", "latitude_deg": 47.398, "longitude_deg": 8.546, "relative_altitude_m": 15}
    fast = [{**way, "speed_m_s": 4.0 + index % 2} for index in range(MAX_ITEMS - 2)]
    ends = {"type": "takeoff", "relative_altitude_m": 15}, {"type": "return_to_launch"}
    head = {"version": 1, "name": "long", "vehicle_type": "multicopter", "cruise_speed_m_s": 6.0}
    plan: Plan = parse_plan({**head, "items": [ends[0], *fast, ends[1]]})
    written = export_plan(plan, TargetFormat.QGC)
    assert len(json.loads(written.text)["mission"]["items"]) > 1.9 * MAX_ITEMS
    assert [item.type for item in convert_to_plan(written.text.encode()).plan.items] == [
        item.type for item in plan.items
    ]


class Counted(list[FileItem]):
    """Counts how often any of its items is looked at."""

    looks = 0

    def __iter__(self) -> Iterator[FileItem]:
        for item in super().__iter__():
            self.looks += 1
            yield item

    def __reversed__(self) -> Iterator[FileItem]:
        for item in super().__reversed__():
            self.looks += 1
            yield item


def test_items_are_read_once_each_however_many_circles_and_cameras_there_are() -> None:
    commands = [LOITER_TO_ALT, *[CAMERA] * 3] * 250
    params = (1.0, 60.0, 0.0, 1.0, 47.0, 8.0, 30.0)
    items = Counted(FileItem(command, 3, params, number, "") for number, command in enumerate(commands, 1))
    ItemReader(VehicleType.FIXED_WING, Report()).read(items)
    assert items.looks <= 3 * len(items)


def test_of_many_findings_the_first_are_told_and_the_rest_are_counted_by_code() -> None:
    conversion = convert_to_plan(with_items(*[simple(CAMERA)] * (MAX_LISTED + 50)))
    told, closing = conversion.findings[:MAX_LISTED], conversion.findings[MAX_LISTED:]
    assert {finding.code for finding in told} == {"conversion.camera"}
    assert [finding.code for finding in closing] == ["conversion.more"] * 2
    assert {finding.kind: finding.message for finding in closing} == {
        FindingKind.LOST: "findings of this kind beyond the first 200: conversion.camera 50",
        FindingKind.ASSUMED: "findings of this kind beyond the first 200: conversion.release_motion 1",
    }


def test_no_kind_is_silent_when_another_fills_the_report() -> None:
    report = Report()
    for number in range(MAX_LISTED):
        report.assume("conversion.instance", f"/{number}", "the first one is assumed")
    report.lose("conversion.camera", "/0", "it is for a camera")
    assert [(finding.kind, finding.code) for finding in report.summarized()[MAX_LISTED:]] == [
        (FindingKind.LOST, "conversion.more")
    ]
