"""A check examines the mission that is uploaded, and keeps nothing of its plan: all is freed as it returns."""

from __future__ import annotations

import gc
import weakref
from pathlib import Path

import pytest

from app.domain.errors import PlanRejectedError
from app.domain.plan import parse_plan
from app.domain.plan.compiler import compile_plan
from app.domain.rules import Severity, checked
from app.domain.vehicle.state import VehicleProfile, VehicleType
from tests.support.paths import ROOT

PLANS = sorted((ROOT / "plans").glob("*.json"))


@pytest.mark.parametrize("file", PLANS, ids=lambda file: file.stem)
def test_what_a_check_looked_at_is_freed_without_the_garbage_collector(file: Path) -> None:
    """A plan of 990 items would leave 30,000 objects until then, and the collector would stop the event loop."""
    plan = parse_plan(file.read_bytes())
    seen = weakref.ref(plan)
    gc.disable()
    try:
        checked(plan, None)
        del plan
        assert seen() is None, "the check left a cycle of references to the plan"
    finally:
        gc.enable()


@pytest.mark.parametrize("file", PLANS, ids=lambda file: file.stem)
def test_the_mission_that_was_examined_is_the_one_that_is_compiled(file: Path) -> None:
    plan = parse_plan(file.read_bytes())
    facts = VehicleProfile(plan.vehicle_type)
    drafted = checked(plan, facts).drafted
    assert drafted is not None
    assert drafted.mission() == compile_plan(plan, facts)


def test_a_plan_for_another_vehicle_has_no_mission() -> None:
    plan = parse_plan(PLANS[0].read_bytes())
    other = next(kind for kind in VehicleType if kind is not plan.vehicle_type)
    found = checked(plan, VehicleProfile(other))
    assert found.drafted is None
    assert any(finding.severity is Severity.ERROR for finding in found.findings)
    with pytest.raises(PlanRejectedError):
        compile_plan(plan, VehicleProfile(other))
