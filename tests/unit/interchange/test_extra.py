"""The `waydrop` objects in a .plan: they add to the file, and what somebody changed in the file counts."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from app.domain.plan import Plan
from app.interchange.findings import ConversionRefused, FindingKind, Report
from app.interchange.plan_draft import finish
from app.interchange.qgc_reader import Unsaid, read_qgc
from app.interchange.qgc_writer import qgc_document
from tests.support.interchange_files import Json
from tests.support.plan_pieces import at, gripper, multicopter, waypoint

PLAN = multicopter(
    waypoint(100, 0, id="door", speed_m_s=6),
    gripper(id="drop", max_offset_m=2),
    cruise_speed_m_s=8,
    order={"id": "RX-1"},
    rally_points=[{**at(50, 0), "absolute_altitude_m": 510}],
)

AT_DOOR = "/mission/items/3/waydrop"
HOME = PLAN.home.model_dump() if PLAN.home is not None else {}
RALLY = {**at(50, 0), "relative_altitude_m": 22.0}


def written() -> Json:
    return copy.deepcopy(qgc_document(PLAN)[0])


def read(document: Json) -> tuple[Plan, set[str]]:
    report = Report()
    plan = finish(read_qgc(document, Unsaid(), report), report)
    return plan, {finding.code for finding in report.findings}


def item_of(document: Json, command: int, last: bool = False) -> Json:
    found: list[Json] = [item for item in document["mission"]["items"] if item["command"] == command]
    return found[-1 if last else 0]


def without_extras(value: Any) -> Any:
    """As QGroundControl saves it: it forgets keys that it does not know."""
    if isinstance(value, list):
        return [without_extras(part) for part in value]
    if isinstance(value, dict):
        return {key: without_extras(part) for key, part in value.items() if key != "waydrop"}
    return value


def test_a_place_that_was_moved_in_the_file_counts() -> None:
    document = written()
    item_of(document, 16)["params"][4] += 0.0001
    plan, _ = read(document)
    door = plan.items[1]
    assert door.type == "waypoint"
    assert door.latitude_deg == pytest.approx(PLAN.items[1].latitude_deg + 0.0001)  # type: ignore[union-attr]
    assert (door.hold_s, door.acceptance_radius_m) == (0.0, None)


def test_a_hold_that_was_changed_in_the_file_counts_and_is_told() -> None:
    document = written()
    item_of(document, 16)["params"][0] = 9
    plan, codes = read(document)
    door = plan.items[1]
    assert door.type == "waypoint"
    assert (door.hold_s, door.acceptance_radius_m) == (9.0, 1.0)
    assert codes == {"conversion.changed_since"}


def test_a_speed_that_was_changed_in_the_file_counts() -> None:
    document = written()
    speeds = [item for item in document["mission"]["items"] if item["command"] == 178]
    for item in speeds:
        item["params"][1] += 1
    plan, _ = read(document)
    assert plan.cruise_speed_m_s == 9
    assert plan.items[1].speed_m_s == 7  # type: ignore[union-attr]


def test_a_rally_point_that_was_moved_in_the_file_counts() -> None:
    document = written()
    document["rallyPoints"]["points"][0][0] = 47.4
    plan, codes = read(document)
    assert plan.rally_points[0].latitude_deg == 47.4
    assert codes == {"conversion.changed_since"}


def test_the_altitude_of_a_rally_point_that_was_changed_in_the_file_counts() -> None:
    document = written()
    document["rallyPoints"]["points"][0][2] = 40
    plan, codes = read(document)
    assert plan.rally_points[0].relative_altitude_m == 40
    assert plan.rally_points[0].absolute_altitude_m is None
    assert codes == {"conversion.changed_since"}


def test_a_wait_that_was_changed_in_the_file_becomes_a_delay() -> None:
    document = written()
    item_of(document, 93)["params"][0] = 12
    plan, _ = read(document)
    assert [item.type for item in plan.items] == ["takeoff", "waypoint", "gripper", "delay", "return_to_launch"]


def test_an_item_that_was_put_in_keeps_the_others_as_they_were() -> None:
    document = written()
    new = {**copy.deepcopy(item_of(document, 16)), "doJumpId": 99}
    del new["waydrop"]
    document["mission"]["items"].insert(1, new)
    plan, _ = read(document)
    assert {item.id for item in PLAN.items} < {item.id for item in plan.items}
    assert next(item for item in plan.items if item.id == "drop") == PLAN.items[2]


def test_what_other_software_saves_is_still_the_same_flight() -> None:
    plan, codes = read(without_extras(written()))
    assert [item.type for item in plan.items] == [
        *("takeoff", "change_speed", "change_speed", "waypoint", "gripper", "delay", "return_to_launch"),
    ]
    drop = plan.items[4]
    assert drop.type == "gripper"
    assert (drop.mode, drop.release_motion) == ("embedded", "stopped")
    assert codes == {"conversion.release_motion", "conversion.planning_speed"}


def test_what_only_waydrop_reads_and_what_nobody_does_is_named() -> None:
    findings = qgc_document(PLAN)[1]
    assert {(finding.kind, finding.code, finding.pointer) for finding in findings} == {
        (FindingKind.KEPT, "conversion.kept_field", "/order"),
        (FindingKind.KEPT, "conversion.kept_field", "/rally_points"),
        (FindingKind.LOST, "conversion.supervision", "/items/2"),
        (FindingKind.KEPT, "conversion.drop_terms", "/items/2"),
    }


def test_a_drop_that_waydrop_supervises_is_in_the_file_a_stop_a_release_and_a_wait() -> None:
    items = qgc_document(PLAN)[0]["mission"]["items"]
    at_door = [item["command"] for item in items].index(16)
    stop, release, wait = items[at_door : at_door + 3]
    assert stop["params"][:2] == [5.0, 1.0]
    assert (release["command"], release["params"][1]) == (211, 0.0)
    assert (wait["command"], wait["params"][0]) == (93, 2.0)


@pytest.mark.parametrize(
    ("extra", "pointer"),
    [
        ({"id": "no spaces"}, f"{AT_DOOR}/id"),
        ({"colour": 1}, f"{AT_DOOR}/colour"),
        ({"role": "king"}, f"{AT_DOOR}/role"),
        ({"fields": {"hold_s": "x"}}, f"{AT_DOOR}/fields/hold_s"),
        ({"fields": {"colour": 1}}, f"{AT_DOOR}/fields/colour"),
        ({"fields": {"type": "land"}}, f"{AT_DOOR}/fields/type"),
        ({"fields": {"latitude_deg": 1}}, f"{AT_DOOR}/fields/latitude_deg"),
        ({"fields": []}, f"{AT_DOOR}/fields"),
        ({"fields": {"hold_s": 9}}, f"{AT_DOOR}/fields/hold_s"),
        (
            {"fields": {"latitude_deg": 1}, "written": {"latitude_deg": 2}},
            f"{AT_DOOR}/fields/latitude_deg",
        ),
    ],
)
def test_an_extra_that_is_none_of_ours_is_refused_at_its_place(extra: Json, pointer: str) -> None:
    document = written()
    assert document["mission"]["items"][3]["command"] == 16
    document["mission"]["items"][3]["waydrop"] = extra
    with pytest.raises(ConversionRefused) as refused:
        read(document)
    assert pointer in {finding.pointer for finding in refused.value.findings}


@pytest.mark.parametrize(
    ("fields", "written"),
    [
        ({"geofence": {}}, {}),
        ({"vehicle_type": "rover"}, {}),
        ({"items": []}, {}),
        ({"home": {**HOME, "latitude_deg": 1}}, {"home": HOME}),
        ({"home": None}, {}),
        ({"rally_points": []}, {}),
        ({"rally_points": [{**RALLY, "latitude_deg": 1}]}, {"rally_points": [RALLY]}),
    ],
)
def test_where_a_vehicle_goes_is_not_said_where_only_waydrop_looks(fields: Json, written: Json) -> None:
    document = written_with(fields, written)
    with pytest.raises(ConversionRefused) as refused:
        read(document)
    (name,) = fields
    assert ("conversion.extra", f"/waydrop/fields/{name}") in {
        (finding.code, finding.pointer) for finding in refused.value.findings
    }


def written_with(fields: Json, replaced: Json) -> Json:
    document = written()
    document["waydrop"] = {"version": 1, "fields": fields, "written": replaced}
    return document
