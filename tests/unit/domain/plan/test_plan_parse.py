"""A plan is read strictly: whatever is wrong is refused, with a code and a JSON pointer."""

from __future__ import annotations

import copy
import json
from typing import Any

import pytest

from app.domain.errors import InvalidInputError
from app.domain.items import ITEM_TYPES
from app.domain.plan import PlanInvalid, parse_plan, plan_hash, plan_json_schema
from app.domain.plan.json_tree import MAX_BODY_BYTES, MAX_ITEMS, MAX_NODES
from tests.support.plan_pieces import RETURN, at, gripper, loiter, plan_json, takeoff, waypoint, winch


def _found(raw: Any) -> list[tuple[str, str]]:
    with pytest.raises(PlanInvalid) as refused:
        parse_plan(raw)
    return [(finding.code, finding.pointer) for finding in refused.value.findings]


def _delivery(**changes: Any) -> dict[str, Any]:
    """A delivery whose waypoint (item 1) is changed; a value of ... takes the field away."""
    plan = plan_json("multicopter", takeoff(), waypoint(id="clinic"), gripper(), RETURN)
    for name, value in changes.items():
        if value is ...:
            del plan["items"][1][name]
        else:
            plan["items"][1][name] = value
    return plan


def test_a_plan_is_read_from_text_bytes_and_data_alike() -> None:
    data = _delivery()
    text = json.dumps(data)
    assert parse_plan(data) == parse_plan(text) == parse_plan(text.encode())


def test_a_plan_survives_being_written_and_read() -> None:
    plan = parse_plan(_delivery())
    assert parse_plan(plan.model_dump(mode="json")) == plan
    assert parse_plan(plan.model_dump_json()) == plan


def test_items_without_an_id_get_one_that_is_not_taken() -> None:
    plan = parse_plan(plan_json("multicopter", takeoff(id="item-2"), waypoint(), gripper(id=None), RETURN))
    assert [item.id for item in plan.items] == ["item-2", "item-2x", "item-3", "item-4"]


def test_null_means_not_given() -> None:
    assert parse_plan(_delivery(yaw_deg=None, absolute_altitude_m=None)) == parse_plan(_delivery())


@pytest.mark.parametrize("name", ["limits", "geofence", "contingency", "rally_points", "order", "home"])
def test_null_means_not_given_in_the_document(name: str) -> None:
    document = plan_json("multicopter", takeoff(), RETURN) | {name: None}
    without = {key: value for key, value in document.items() if key != name}
    assert parse_plan(document) == parse_plan(json.dumps(document)) == parse_plan(without)


@pytest.mark.parametrize(
    "item",
    [
        gripper(hold_s=None, instance=None, mode=None, consent_timeout_s=None),
        gripper(alternate={**at(50, 50), "relative_altitude_m": 30, "hold_s": None, "yaw_deg": None}),
    ],
    ids=["a drop", "its alternate"],
)
def test_null_means_not_given_in_an_item(item: dict[str, Any]) -> None:
    parsed = parse_plan(plan_json("multicopter", takeoff(), waypoint(), item, RETURN))
    assert parsed == parse_plan(plan_json("multicopter", takeoff(), waypoint(), _without_nulls(item), RETURN))


def test_null_means_not_given_in_a_part() -> None:
    document = plan_json("multicopter", takeoff(), RETURN)
    nulls = {"contingency": {"on_drop_failure": None}, "geofence": {"polygons": None, "circles": None}}
    assert parse_plan(document | nulls) == parse_plan(document)


@pytest.mark.parametrize(
    ("item", "pointer"),
    [
        (gripper(consent=None), "/items/2/consent"),
        (winch(mode="supervised", consent=None), "/items/2/consent"),
        (
            gripper(alternate={**at(50, 50), "relative_altitude_m": 30, "consent": None}),
            "/items/2/alternate/consent",
        ),
    ],
    ids=["a gripper", "a winch", "an alternate"],
)
def test_null_is_no_answer_to_whether_consent_is_needed(item: dict[str, Any], pointer: str) -> None:
    document = plan_json("multicopter", takeoff(), waypoint(), item, RETURN)
    assert _found(document) == _found(json.dumps(document)) == [("plan.bad_value", pointer)]
    with pytest.raises(PlanInvalid) as refused:
        parse_plan(document)
    assert "null" in refused.value.findings[0].message


def test_null_is_no_value_of_a_required_field() -> None:
    assert _found(plan_json("multicopter", takeoff(), waypoint(latitude_deg=None), RETURN)) == [
        ("plan.wrong_type", "/items/1/latitude_deg")
    ]


def _without_nulls(part: Any) -> Any:
    if not isinstance(part, dict):
        return part
    return {name: _without_nulls(value) for name, value in part.items() if value is not None}


def test_a_whole_number_is_as_good_as_an_integer() -> None:
    back = {"type": "jump", "target": "a"}
    items = [takeoff(), waypoint(id="a")]
    whole = plan_json("multicopter", *items, gripper(instance=1.0), {**back, "repeats": 2.0}, RETURN)
    integer = plan_json("multicopter", *items, gripper(instance=1), {**back, "repeats": 2}, RETURN)
    assert parse_plan(whole | {"version": 1.0}).model_dump_json() == parse_plan(integer).model_dump_json()
    assert _found(plan_json("multicopter", takeoff(), waypoint(), gripper(instance=1.5), RETURN)) == [
        ("plan.wrong_type", "/items/2/instance")
    ]


def test_a_byte_order_mark_before_the_text_is_no_fault() -> None:
    assert parse_plan(json.dumps(_delivery()).encode("utf-8-sig")) == parse_plan(_delivery())


def test_an_integer_is_as_good_as_a_float() -> None:
    assert parse_plan(_delivery(relative_altitude_m=30)) == parse_plan(_delivery(relative_altitude_m=30.0))


@pytest.mark.parametrize(
    ("changes", "code", "pointer"),
    [
        ({"speeed": 3}, "plan.unknown_field", "/items/1/speeed"),
        ({"latitude_deg": ...}, "plan.missing_field", "/items/1/latitude_deg"),
        ({"latitude_deg": 90.1}, "plan.out_of_range", "/items/1/latitude_deg"),
        ({"longitude_deg": -180.1}, "plan.out_of_range", "/items/1/longitude_deg"),
        ({"latitude_deg": "47"}, "plan.wrong_type", "/items/1/latitude_deg"),
        ({"latitude_deg": True}, "plan.wrong_type", "/items/1/latitude_deg"),
        ({"hold_s": -1}, "plan.out_of_range", "/items/1/hold_s"),
        ({"hold_s": float("nan")}, "plan.not_finite", "/items/1/hold_s"),
        ({"hold_s": float("inf")}, "plan.not_finite", "/items/1/hold_s"),
        ({"hold_s": 10**30}, "plan.not_finite", "/items/1/hold_s"),
        ({"acceptance_radius_m": 0}, "plan.out_of_range", "/items/1/acceptance_radius_m"),
        ({"relative_altitude_m": ...}, "plan.altitude_exactly_one", "/items/1"),
        ({"absolute_altitude_m": 500}, "plan.altitude_exactly_one", "/items/1"),
        ({"relative_altitude_m": None}, "plan.altitude_exactly_one", "/items/1"),
        ({"type": "fly"}, "plan.unknown_item_type", "/items/1"),
        ({"type": ...}, "plan.missing_field", "/items/1"),
        ({"id": "has space"}, "plan.bad_value", "/items/1/id"),
        ({"id": "x" * 65}, "plan.too_long", "/items/1/id"),
        ({"hold_s": {1, 2}}, "plan.not_json", "/items/1/hold_s"),
        ({"id": "\ud800"}, "plan.not_json", "/items/1/id"),
    ],
)
def test_a_bad_field_is_refused_where_it_stands(changes: dict[str, Any], code: str, pointer: str) -> None:
    assert _found(_delivery(**changes)) == [(code, pointer)]


@pytest.mark.parametrize(
    ("more", "code", "pointer"),
    [
        ({"version": 2}, "plan.bad_value", "/version"),
        ({"name": "clinic \u202enur"}, "plan.bad_value", "/name"),
        ({"order": {"id": "A\x1b[2J"}}, "plan.bad_value", "/order/id"),
        ({"order": {"id": "A", "notes": "ring\x00"}}, "plan.bad_value", "/order/notes"),
        ({"version": "1"}, "plan.bad_value", "/version"),
        ({"version": True}, "plan.bad_value", "/version"),
        ({"name": ""}, "plan.too_short", "/name"),
        ({"name": "   "}, "plan.bad_value", "/name"),
        ({"name": "\u00a0"}, "plan.bad_value", "/name"),
        ({"name": "a\u00adb"}, "plan.bad_value", "/name"),
        ({"name": "a\U000e0041"}, "plan.bad_value", "/name"),
        ({"order": {"id": " "}}, "plan.bad_value", "/order/id"),
        ({"vehicle_type": "submarine"}, "plan.bad_value", "/vehicle_type"),
        ({"items": []}, "plan.too_few_items", "/items"),
        ({"items": {}}, "plan.wrong_type", "/items"),
        ({"home": {"latitude_deg": 1, "longitude_deg": 2}}, "plan.missing_field", "/home/absolute_altitude_m"),
        ({"a/b~c": 1}, "plan.unknown_field", "/a~1b~0c"),
        ({"order": {}}, "plan.missing_field", "/order/id"),
        (
            {"geofence": {"polygons": [{"kind": "inclusion", "vertices": [at(0, 0), at(1, 1)]}]}},
            "plan.too_few_items",
            "/geofence/polygons/0/vertices",
        ),
        (
            {"geofence": {"circles": [{"kind": "around", **at(0, 0), "radius_m": 5}]}},
            "plan.bad_value",
            "/geofence/circles/0/kind",
        ),
        ({"limits": {"max_distance_m": 0}}, "plan.out_of_range", "/limits/max_distance_m"),
    ],
)
def test_a_bad_part_is_refused_where_it_stands(more: dict[str, Any], code: str, pointer: str) -> None:
    assert _found(plan_json("multicopter", takeoff(), RETURN) | more) == [(code, pointer)]


@pytest.mark.parametrize(
    ("item", "code"),
    [
        (loiter("time", duration_s=None), "plan.loiter_fields"),
        (loiter("turns"), "plan.loiter_fields"),
        (loiter("unlimited", duration_s=3), "plan.loiter_fields"),
        (loiter("time", radius_m=0), "plan.out_of_range"),
        (winch(action="length"), "plan.winch_fields"),
        (winch(action="rate"), "plan.winch_fields"),
        (takeoff(latitude_deg=47.0), "plan.half_position"),
    ],
)
def test_fields_that_belong_together_come_together(item: dict[str, Any], code: str) -> None:
    assert _found(plan_json("multicopter", item)) == [(code, "/items/0")]


def test_a_drop_says_how_it_is_released() -> None:
    drop = gripper()
    del drop["release_motion"]
    assert _found(plan_json("multicopter", takeoff(), drop)) == [("plan.missing_field", "/items/1/release_motion")]


def test_an_id_used_twice_is_refused_at_the_second() -> None:
    plan = plan_json("multicopter", takeoff(id="a"), waypoint(id="b"), waypoint(id="a"), RETURN)
    assert _found(plan) == [("plan.duplicate_id", "/items/2/id")]


def test_everything_wrong_is_found_at_once() -> None:
    plan = _delivery(latitude_deg=91, extra=1) | {"name": "", "unknown": 1}
    assert set(_found(plan)) == {
        ("plan.out_of_range", "/items/1/latitude_deg"),
        ("plan.unknown_field", "/items/1/extra"),
        ("plan.too_short", "/name"),
        ("plan.unknown_field", "/unknown"),
    }


def test_a_finding_names_the_item() -> None:
    with pytest.raises(PlanInvalid) as refused:
        parse_plan(_delivery(latitude_deg=91))
    assert refused.value.findings[0].item_id == "clinic"
    assert isinstance(refused.value, InvalidInputError)
    assert refused.value.extra["findings"] == [refused.value.findings[0].model_dump(mode="json")]


@pytest.mark.parametrize(
    ("text", "code", "pointer"),
    [
        ("", "plan.not_json", ""),
        ("{", "plan.not_json", ""),
        (b"\xff\xfe", "plan.not_json", ""),
        ("[]", "plan.not_an_object", ""),
        ("null", "plan.not_an_object", ""),
        ('{"name": NaN}', "plan.not_finite", "/name"),
        ('{"name": [1, -Infinity]}', "plan.not_finite", "/name/1"),
        ('{"name": 1e999}', "plan.not_finite", "/name"),
        ('{"name": ' + "9" * 5000 + "}", "plan.not_finite", "/name"),
        ('{"name": "a", "name": "b"}', "plan.duplicate_key", "/name"),
        ('{"order": {"id": "a", "id": "b"}}', "plan.duplicate_key", "/order/id"),
        ("[" * 100_000, "plan.too_deep", ""),
        ('{"a":' * 100_000, "plan.too_deep", ""),
        (" " * (MAX_BODY_BYTES + 1), "plan.too_large", ""),
        (f"[{'[],' * MAX_NODES}[]]", "plan.too_large", ""),
    ],
)
def test_hostile_json_is_refused(text: str | bytes, code: str, pointer: str) -> None:
    assert _found(text) == [(code, pointer)]


def test_brackets_inside_strings_are_no_depth() -> None:
    plan = _delivery() | {"name": '[{"\\' * 40}
    assert parse_plan(json.dumps(plan)).name == '[{"\\' * 40


def test_a_thousand_items_are_read_and_one_more_is_not() -> None:
    plan = plan_json("multicopter", *[waypoint()] * MAX_ITEMS)
    assert len(parse_plan(plan).items) == MAX_ITEMS
    plan["items"].append(RETURN)
    assert _found(plan) == [("plan.too_many_items", "/items")]


def test_data_that_contains_itself_is_refused() -> None:
    plan = _delivery()
    plan["order"] = plan
    assert ("plan.too_deep", "/order" * 17) in _found(plan)


def test_the_hash_is_of_what_the_plan_means() -> None:
    plan = _delivery()
    reordered = dict(reversed(copy.deepcopy(plan).items())) | {"rally_points": []}
    assert plan_hash(parse_plan(plan)) == plan_hash(parse_plan(reordered))
    assert plan_hash(parse_plan(plan)) != plan_hash(parse_plan(_delivery(hold_s=1)))


def test_the_schema_names_every_item_type_and_takes_no_unknown_field() -> None:
    schema = plan_json_schema()
    items = schema["properties"]["items"]["items"]
    assert items["discriminator"]["propertyName"] == "type"
    assert len(items["oneOf"]) == len(ITEM_TYPES)
    assert all(part["additionalProperties"] is False for part in schema["$defs"].values() if part["type"] == "object")
