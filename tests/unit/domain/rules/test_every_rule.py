"""Every rule finds the plan that breaks it, at the right place, and leaves the nearest right plan alone."""

from __future__ import annotations

import pytest

from app.domain.rules import RULES, Severity, check_plan
from tests.support.plan_pieces import multicopter, square, waypoint
from tests.support.rule_case import Case, codes
from tests.support.rule_cases import CASES
from tests.unit.domain.rules.drop_cases import POSITION_CASES

BY_CASE = pytest.mark.parametrize("case", CASES, ids=str)


@BY_CASE
def test_the_wrong_plan_is_found_where_it_is_wrong(case: Case) -> None:
    findings = check_plan(case.wrong, case.wrong_facts, case.wrong_wind)
    found = [finding for finding in findings if finding.code == case.code]
    assert [finding.pointer for finding in found] == [case.pointer]
    assert found[0].message
    assert found[0].hint


@BY_CASE
def test_the_right_plan_is_left_alone(case: Case) -> None:
    assert case.code not in codes(case.right, case.right_facts, case.right_wind)


@BY_CASE
def test_a_finding_about_an_item_names_it(case: Case) -> None:
    for finding in check_plan(case.wrong, case.wrong_facts):
        if finding.pointer.startswith("/items/"):
            assert finding.item_id == case.wrong.items[int(finding.pointer.split("/")[2])].id


def test_a_polygon_that_is_too_small_is_not_said_to_intersect_itself() -> None:
    small = multicopter(waypoint(), geofence={"polygons": [square("exclusion", 50, 50, 0.35)]})
    (found,) = [finding for finding in check_plan(small, None) if finding.code == "geofence.self_crossing"]
    assert found.message == "the polygon has an area of 0.49 m²; the smallest is 1 m²"


def test_every_rule_has_a_case() -> None:
    assert {rule.code for rule in RULES} == {case.code for case in CASES}


def test_codes_are_unique() -> None:
    assert len({rule.code for rule in RULES}) == len(RULES)


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.code)
def test_a_rule_says_why_and_who_says_so(rule: object) -> None:
    assert getattr(rule, "reason", "").endswith(".")
    assert getattr(rule, "source", "")


def test_errors_come_before_warnings_and_in_the_order_of_the_plan() -> None:
    findings = check_plan(POSITION_CASES[0].wrong, None)
    severities = [finding.severity for finding in findings]
    assert severities == sorted(severities, key=lambda severity: severity is not Severity.ERROR)
