"""What is far from a plan is refused before pydantic names each of its faults, for everything else waits meanwhile."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest
from pydantic import ValidationError

from app.domain.plan import Plan, PlanInvalid, parse_plan
from app.domain.plan.json_tree import MAX_FINDINGS
from app.domain.plan.parse import MAX_ENTRIES
from tests.support.plan_pieces import plan_json, waypoint

MANY = 100_000


def polygon(*vertices: object) -> dict[str, Any]:
    return {"geofence": {"polygons": [{"kind": "inclusion", "vertices": list(vertices)}]}}


FAR_OFF = {
    "fields that no plan has": ({f"k{number}": 0 for number in range(MANY)}, "plan.unknown_field", "/k0"),
    "such fields in items": (
        {"items": [{**waypoint(), **{f"k{number}": 0 for number in range(100)}}] * 900},
        "plan.unknown_field",
        "/items/0/k0",
    ),
    "items that are none": ({"items": [0] * MAX_ENTRIES}, "plan.wrong_type", "/items/0"),
    "vertices that are none": (polygon(*[0] * MANY), "plan.too_many_items", "/geofence/polygons/0/vertices"),
    "far too many polygons": (
        {"geofence": {"polygons": [{}] * (MANY // 2)}},
        "plan.too_many_items",
        "/geofence/polygons",
    ),
}


@pytest.mark.parametrize("name", FAR_OFF)
def test_a_document_far_from_a_plan_is_refused_by_its_outline_with_the_first_of_its_faults(name: str) -> None:
    changes, code, pointer = FAR_OFF[name]
    with pytest.raises(PlanInvalid) as refused:
        parse_plan(plan_json("multicopter", waypoint()) | changes)
    assert (refused.value.findings[0].code, refused.value.findings[0].pointer) == (code, pointer)
    assert len(refused.value.findings) <= MAX_FINDINGS
    assert refused.value.__context__ is None, "pydantic must not look at it"


@pytest.mark.parametrize("name", [name for name, (_, code, _) in FAR_OFF.items() if code == "plan.too_many_items"])
def test_a_list_that_is_far_too_long_is_refused_before_anything_is_copied(name: str) -> None:
    changes, code, pointer = FAR_OFF[name]
    document = plan_json("multicopter", waypoint()) | changes | {"name": math.nan}
    for given in (document, json.dumps(document)):
        with pytest.raises(PlanInvalid) as refused:
            parse_plan(given)
        assert [(finding.code, finding.pointer) for finding in refused.value.findings] == [(code, pointer)]


def test_of_a_polygon_the_first_corner_that_is_none_is_named_and_not_every_one() -> None:
    corners = [{"latitude_deg": 47.0, "longitude_deg": 8.0}, *[{}] * 900]
    with pytest.raises(ValidationError) as found:
        Plan.model_validate_json(json.dumps(plan_json("multicopter", waypoint()) | polygon(*corners)))
    assert {error["loc"][4:5] for error in found.value.errors()} == {(1,), ()}, "and that it ends there"


EVERY_FIELD = {
    **waypoint(),
    **dict.fromkeys(["turns", "repeats", "rate_m_s", "to", "radius_m", "consent", "mode", "feed"], 0),
}
PLACE = {"latitude_deg": "x", "longitude_deg": "x", "relative_altitude_m": "x"}


@pytest.mark.parametrize(
    "changes",
    [
        {"items": [{**EVERY_FIELD, **PLACE}] * MAX_ENTRIES},
        {"rally_points": [PLACE] * 256},
        {"geofence": {"circles": [PLACE] * 64}},
        {"geofence": {"polygons": [PLACE] * 64}},
    ],
    ids=lambda changes: str(next(iter(changes))),
)
def test_of_many_entries_with_the_fields_of_others_pydantic_sees_as_many_as_are_told(changes: dict[str, Any]) -> None:
    with pytest.raises(PlanInvalid) as refused:
        parse_plan(plan_json("multicopter", waypoint()) | changes)
    assert len(refused.value.findings) == MAX_FINDINGS
    assert isinstance(refused.value.__context__, ValidationError)
    assert refused.value.__context__.error_count() < 2 * MAX_FINDINGS


@pytest.mark.parametrize("inner", ['"0": 1', ",".join(f'"{number}": 1, "{number}": 2' for number in range(200))])
def test_what_is_below_a_very_long_name_is_not_told_with_all_of_it_each(inner: str) -> None:
    name = "k" * 100_000
    with pytest.raises(PlanInvalid) as refused:
        parse_plan(f'{{"version": 1, "{name}": {{{inner}}}}}')
    assert [finding.code for finding in refused.value.findings] == ["plan.unknown_field"]
    assert refused.value.findings[0].pointer == f"/{name}"


def test_what_is_in_an_unknown_field_is_not_told() -> None:
    with pytest.raises(PlanInvalid) as refused:
        parse_plan(plan_json("multicopter", waypoint()) | {"nix": {f"k{number}": 0 for number in range(MANY)}})
    assert [finding.pointer for finding in refused.value.findings] == ["/nix"]


def test_a_few_faults_are_all_told_each_at_its_place() -> None:
    document = plan_json("multicopter", waypoint(), waypoint()) | {"nix": 1, "rally_points": [0]}
    document["items"][1]["colour"] = "red"
    with pytest.raises(PlanInvalid) as refused:
        parse_plan(document)
    assert {finding.pointer for finding in refused.value.findings} == {"/nix", "/rally_points/0", "/items/1/colour"}
