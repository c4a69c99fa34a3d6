"""A plan written as .plan and read again is the same plan, whatever it says."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings

from app.domain.mission import MavCmd
from app.domain.plan import Plan, parse_plan
from app.interchange.formats import SourceFormat, convert_to_plan
from app.interchange.qgc_writer import qgc_document, qgc_text
from tests.support.paths import ROOT
from tests.support.plan_pieces import gripper, land, loiter, multicopter, waypoint
from tests.support.plan_strategies import PLANS, sensible_plans

EXAMPLES = sorted((ROOT / "plans").glob("*.json"))
SLOW_DATA = settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)


def back(plan: Plan) -> Plan:
    text, _ = qgc_text(plan)
    conversion = convert_to_plan(text.encode())
    assert conversion.source is SourceFormat.QGC
    return conversion.plan


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_every_example_plan_comes_back_equal_and_only_a_hidden_place_is_told(path: Path) -> None:
    plan = parse_plan(path.read_bytes())
    conversion = convert_to_plan(qgc_text(plan)[0].encode())
    assert conversion.plan == plan
    assert [finding.code for finding in conversion.findings] == ["conversion.alternate"] * len(plan.alternates)


@SLOW_DATA
@given(PLANS)
def test_any_plan_comes_back_equal(plan: Plan) -> None:
    assert back(plan) == plan


@SLOW_DATA
@given(sensible_plans())
def test_any_sensible_plan_comes_back_equal(plan: Plan) -> None:
    assert back(plan) == plan


def test_a_jump_to_a_drop_that_needs_a_pause_before_it_comes_back_equal() -> None:
    plan = multicopter(waypoint(), land(100), gripper(id="drop"), {"type": "jump", "target": "drop", "repeats": 1})
    assert back(plan) == plan


def test_a_stopped_drop_after_a_loiter_is_written_with_a_pause_and_comes_back_equal() -> None:
    plan = multicopter(loiter(duration_s=0), gripper(mode="embedded"))
    document, _ = qgc_document(plan)
    commands = [item["command"] for item in document["mission"]["items"]]
    release = commands.index(MavCmd.DO_GRIPPER)
    assert commands[release - 2 : release] == [MavCmd.NAV_LOITER_TIME, MavCmd.NAV_DELAY]
    assert back(plan) == plan


@pytest.mark.parametrize(("duration_s", "told"), [(0, True), (30, False)])
def test_a_file_that_releases_before_the_point_of_a_loiter_is_told_so(duration_s: float, told: bool) -> None:
    document, _ = qgc_document(multicopter(loiter(duration_s=duration_s), gripper("moving", mode="embedded")))
    for item in document["mission"]["items"]:
        item.pop("waydrop", None)
    findings = convert_to_plan(json.dumps(document).encode()).findings
    assert ("conversion.braking" in [finding.code for finding in findings]) is told
