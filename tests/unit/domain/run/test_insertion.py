"""Items that are put into a plan are told what is wrong with them as they were given."""

from __future__ import annotations

from typing import Any

import pytest

from app.domain.plan import PlanInvalid, parse_plan
from app.domain.run.mission_change import with_items
from tests.support.plan_pieces import RETURN, gripper, plan_json, takeoff, waypoint

PLAN = parse_plan(
    plan_json("multicopter", takeoff(), waypoint(id="clinic"), gripper(), waypoint(id="school"), RETURN)
)  # fmt: skip


@pytest.mark.parametrize(
    ("items", "found"),
    [
        ([{}], [("/items/0", "the field 'type' is missing")]),
        (["nix"], [("/items/0", "'items[0]' must be an object, not 'nix'")]),
        (
            [waypoint(), waypoint(latitude_deg=91)],
            [("/items/1/latitude_deg", "'latitude_deg' must be at most 90, not 91")],
        ),
        ([waypoint(id="clinic")], [("/items/0", "the id clinic is already used by an earlier item")]),
        (
            [waypoint(id="new"), waypoint(id="school")],
            [("/items/1", "the id school is already used by an earlier item")],
        ),
        ([waypoint(id="a"), waypoint(id="a")], [("/items/1/id", "the id a is already used by an earlier item")]),
        ([waypoint()] * 1000, [("/items", "1005 items; the limit is 1000")]),
    ],
)
def test_a_finding_points_to_the_item_that_was_given(items: list[Any], found: list[tuple[str, str]]) -> None:
    with pytest.raises(PlanInvalid) as refused:
        with_items(PLAN, items, at="clinic", after=True)
    assert [(finding.pointer, finding.message) for finding in refused.value.findings] == found
