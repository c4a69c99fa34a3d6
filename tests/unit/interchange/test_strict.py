"""A file is read strictly: whatever is wrong with it is said with its place, and nothing is guessed."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from typing import Any

import pytest

from app.domain.plan.json_tree import MAX_BODY_BYTES
from app.domain.validation.finding import Finding
from app.interchange.findings import ConversionRefused
from app.interchange.formats import SourceFormat, convert_to_plan
from tests.support.interchange_files import Json, document, raw

GOOD = document("multicopter-delivery.plan")
ITEM = "/mission/items/1"
Change = Callable[[Json], Any]


def refusals(content: bytes, **options: Any) -> tuple[Finding, ...]:
    with pytest.raises(ConversionRefused) as refused:
        convert_to_plan(content, **options)
    return refused.value.findings


def item(**changes: Any) -> Change:
    return lambda plan: plan["mission"]["items"][1].update(changes)


def param(number: int, value: Any, index: int = 1) -> Change:
    return lambda plan: plan["mission"]["items"][index]["params"].__setitem__(number - 1, value)


def simple(command: int, *params: Any, frame: int = 2) -> Json:
    values = [*params, *[0] * (7 - len(params))]
    return {"type": "SimpleItem", "autoContinue": True, "command": command, "frame": frame, "params": values}


def inserted(new: Any) -> Change:
    return lambda plan: plan["mission"]["items"].insert(1, new)


CASES: list[tuple[Change, str, str]] = [
    (lambda plan: plan.update(version=2), "conversion.version", "/version"),
    (lambda plan: plan.update(fileType="Mission"), "conversion.file_type", "/fileType"),
    (lambda plan: plan.pop("mission"), "conversion.missing", ""),
    (lambda plan: plan.update(mission=[]), "conversion.wrong_type", "/mission"),
    (lambda plan: plan["mission"].update(version="2"), "conversion.wrong_type", "/mission/version"),
    (lambda plan: plan["mission"].update(version=1), "conversion.version", "/mission/version"),
    (lambda plan: plan["mission"].update(items={}), "conversion.wrong_type", "/mission/items"),
    (lambda plan: plan["mission"].update(items=[]), "plan.too_few_items", "/mission/items"),
    (lambda plan: plan["mission"].update(vehicleType=6), "conversion.vehicle_type", "/mission/vehicleType"),
    (
        lambda plan: plan["mission"].update(plannedHomePosition=[1, 2]),
        "conversion.wrong_type",
        "/mission/plannedHomePosition",
    ),
    (
        lambda plan: plan["mission"].update(plannedHomePosition=[91, 2, 3]),
        "plan.out_of_range",
        "/mission/plannedHomePosition/0",
    ),
    (inserted(7), "conversion.wrong_type", ITEM),
    (item(type="Item"), "conversion.item_type", f"{ITEM}/type"),
    (item(command="16"), "conversion.wrong_type", f"{ITEM}/command"),
    (item(command=16.5), "conversion.wrong_type", f"{ITEM}/command"),
    (item(command=True), "conversion.wrong_type", f"{ITEM}/command"),
    (item(command=99), "conversion.command", ITEM),
    (item(autoContinue=1), "conversion.wrong_type", f"{ITEM}/autoContinue"),
    (item(autoContinue=False), "conversion.auto_continue", f"{ITEM}/autoContinue"),
    (item(params=[0] * 6), "conversion.wrong_type", f"{ITEM}/params"),
    (item(frame=10), "conversion.frame", ITEM),
    (item(frame=2), "conversion.frame", ITEM),
    (param(1, "5"), "conversion.wrong_type", f"{ITEM}/params/0"),
    (param(1, -5), "plan.out_of_range", f"{ITEM}/params/0"),
    (param(5, 91), "plan.out_of_range", f"{ITEM}/params/4"),
    (param(6, None), "conversion.missing", f"{ITEM}/params/5"),
    (param(7, None), "conversion.missing", f"{ITEM}/params/6"),
    (param(2, None, index=2), "conversion.missing", "/mission/items/2/params/1"),
    (param(2, 2, index=2), "conversion.bad_parameter", "/mission/items/2/params/1"),
    (param(1, 1.5, index=2), "conversion.bad_parameter", "/mission/items/2/params/0"),
    (inserted(simple(177, 40, 2)), "conversion.jump", f"{ITEM}/params/0"),
    (inserted({**simple(177, 3, 2), "doJumpId": 3}), "conversion.jump", f"{ITEM}/params/0"),
    (inserted(simple(177, 1, -1)), "plan.out_of_range", f"{ITEM}/params/1"),
    (inserted(simple(183, 5, 1900)), "conversion.command", ITEM),
    (inserted(simple(94, 0, 0, 0, 0, 47.398, 8.546, 0, frame=3)), "conversion.command", ITEM),
    (inserted({"type": "ComplexItem"}), "conversion.missing", ITEM),
    (inserted({"type": "ComplexItem", "complexItemType": "CorridorScan"}), "conversion.complex_item", None),
    (lambda plan: plan["geoFence"].update(version=1), "conversion.version", "/geoFence/version"),
    (lambda plan: plan["geoFence"].pop("circles"), "conversion.missing", "/geoFence"),
    (
        lambda plan: plan["geoFence"]["circles"][0].update(inclusion=0),
        "conversion.wrong_type",
        "/geoFence/circles/0/inclusion",
    ),
    (
        lambda plan: plan["geoFence"]["circles"][0]["circle"].update(radius=-4),
        "plan.out_of_range",
        "/geoFence/circles/0/circle/radius",
    ),
    (
        lambda plan: plan["geoFence"]["polygons"][0]["polygon"].__delitem__(slice(2, None)),
        "plan.too_few_items",
        "/geoFence/polygons/0",
    ),
    (
        lambda plan: plan["geoFence"]["polygons"][0]["polygon"][1].__setitem__(0, 100),
        "plan.out_of_range",
        "/geoFence/polygons/0/polygon/1",
    ),
    (
        lambda plan: plan["rallyPoints"]["points"][0].__setitem__(2, None),
        "conversion.missing",
        "/rallyPoints/points/0",
    ),
    (lambda plan: plan["rallyPoints"].update(version=1), "conversion.version", "/rallyPoints/version"),
]  # type: ignore[list-item]


@pytest.mark.parametrize(("change", "code", "pointer"), CASES)
def test_what_is_wrong_is_refused_at_its_place(change: Change, code: str, pointer: str | None) -> None:
    plan = copy.deepcopy(GOOD)
    change(plan)
    found = {(finding.code, finding.pointer) for finding in refusals(json.dumps(plan).encode())}
    if pointer is None:
        assert code in {found_code for found_code, _ in found}
    else:
        assert (code, pointer) in found


@pytest.mark.parametrize(
    ("change", "pointer"),
    [(item(Altitude=50), f"{ITEM}/Altitude"), (item(AltitudeMode=2), f"{ITEM}/AltitudeMode")],
)
def test_of_two_altitudes_the_one_that_qgroundcontrol_would_send_is_taken_and_that_is_said(
    change: Change, pointer: str
) -> None:
    plan = copy.deepcopy(GOOD)
    change(plan)
    conversion = convert_to_plan(json.dumps(plan).encode())
    assert conversion.plan == convert_to_plan(json.dumps(GOOD).encode()).plan
    assert [
        (finding.kind, finding.pointer) for finding in conversion.findings if finding.code == "conversion.two_altitudes"
    ] == [("assumed", pointer)]


@pytest.mark.parametrize(
    ("number", "message"),
    [
        (None, "the jump has no target item"),
        (40, "the jump goes to number 40, which no item has"),
    ],
)
def test_a_jump_to_nowhere_is_refused_in_words(number: int | None, message: str) -> None:
    plan = copy.deepcopy(GOOD)
    inserted(simple(177, number, 2))(plan)
    (finding,) = refusals(json.dumps(plan).encode())
    assert (finding.code, finding.pointer, finding.message) == ("conversion.jump", f"{ITEM}/params/0", message)


def test_all_that_is_wrong_is_said_at_once() -> None:
    plan = copy.deepcopy(GOOD)
    item(command=99)(plan)
    param(2, 7, index=2)(plan)
    plan["rallyPoints"]["version"] = 9
    codes = {finding.code for finding in refusals(json.dumps(plan).encode())}
    assert codes == {"conversion.command", "conversion.bad_parameter", "conversion.version"}


@pytest.mark.parametrize("number", [80, 94, 112, 183, 187])
def test_a_command_that_a_plan_has_not_is_called_by_its_name_and_what_to_do_is_said(number: int) -> None:
    plan = copy.deepcopy(GOOD)
    inserted(simple(number))(plan)
    (finding,) = refusals(json.dumps(plan).encode())
    assert f"({number})" in finding.message
    assert finding.hint


@pytest.mark.parametrize(
    ("content", "code"),
    [
        (b"", "plan.not_json"),
        (b"\xff\xfe", "conversion.encoding"),
        (b"[" * 100_000, "plan.too_deep"),
        (b'{"fileType": "Plan", "mission": {"items": [NaN]}}', "plan.not_finite"),
        (b'{"fileType": "Plan", "fileType": "Plan"}', "plan.duplicate_key"),
        (b" " * (MAX_BODY_BYTES + 1), "conversion.too_large"),
        (b"[]", "conversion.format"),
        (b"{}", "conversion.format"),
        (b'{"type": "FeatureCollection", "features": []}', "conversion.format"),
        (b"<kml/>", "conversion.format"),
        (b"QGC WPL 100\n", "conversion.version"),
    ],
)
def test_a_document_of_no_known_format_is_refused(content: bytes, code: str) -> None:
    assert code in {finding.code for finding in refusals(content)}


def test_a_format_that_was_asked_for_and_is_not_there_is_refused() -> None:
    (finding,) = refusals(raw("multicopter-delivery.plan"), source=SourceFormat.WAYPOINTS)
    assert finding.code == "conversion.format"


def test_a_vtol_that_takes_off_like_a_multicopter_is_refused() -> None:
    plan = copy.deepcopy(GOOD)
    plan["mission"]["vehicleType"] = 22
    assert {finding.code for finding in refusals(json.dumps(plan).encode())} == {"conversion.vtol_takeoff"}
