"""Every example plan compiles to exactly the mission that was reviewed."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.domain.plan import parse_plan
from app.domain.plan.compiler import compile_plan
from app.domain.prediction import predict
from app.domain.rules import Severity, check_plan, default_facts
from tests.support.golden_mission import GOLDEN, PLANS, RULES_PAGE, golden_path, golden_text
from tools.reference import rules_page

BY_NAME = pytest.mark.parametrize("plan", PLANS, ids=lambda plan: plan.stem)


@BY_NAME
def test_an_example_plan_compiles_to_its_golden_mission(plan: Path) -> None:
    assert golden_text(plan) == golden_path(plan).read_text(encoding="utf-8")


@BY_NAME
def test_an_example_plan_has_no_errors(plan: Path) -> None:
    findings = check_plan(parse_plan(plan.read_bytes()), None)
    assert [finding for finding in findings if finding.severity is Severity.ERROR] == []


@BY_NAME
def test_an_example_plan_is_short_enough_to_be_flown_by_a_test(plan: Path) -> None:
    parsed = parse_plan(plan.read_bytes())
    assert 20 < predict(parsed, default_facts(parsed.vehicle_type)).duration_s < 300


@BY_NAME
def test_an_example_plan_has_a_drop_and_the_home_of_the_examples(plan: Path) -> None:
    parsed = parse_plan(plan.read_bytes())
    assert len(compile_plan(parsed, default_facts(parsed.vehicle_type)).drops) == 1
    assert parsed.home is not None
    assert (parsed.home.latitude_deg, parsed.home.longitude_deg) == (47.397742, 8.545594)


def test_there_is_an_example_of_each_vehicle_type() -> None:
    types = {parse_plan(plan.read_bytes()).vehicle_type.value for plan in PLANS}
    assert types == {"multicopter", "fixed_wing", "vtol", "rover", "airship"}


def test_no_golden_mission_is_left_over() -> None:
    assert {path.name for path in GOLDEN.glob("*.mission.json")} == {golden_path(plan).name for plan in PLANS}


def test_the_page_of_rules_is_current() -> None:
    assert RULES_PAGE.read_text(encoding="utf-8") == rules_page()
