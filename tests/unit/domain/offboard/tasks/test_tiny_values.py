"""Values that are divided by, or become 0 as float32, are refused where they are read, in words."""

from __future__ import annotations

import json

import pytest
from pydantic import TypeAdapter, ValidationError

from app.domain.offboard.tasks.forms import Task, TaskTerms
from app.domain.plan import PlanInvalid, parse_plan
from tests.support.paths import PLANS

CIRCLE = {"type": "circle", "center": {"east_m": 0.0, "north_m": 0.0}, "radius_m": 20.0}


@pytest.mark.parametrize("speed_m_s", [1e-170, 1e-50, 0.0, -1.0, 0.05])
def test_a_task_has_a_speed_that_a_vehicle_can_fly(speed_m_s: float) -> None:
    with pytest.raises(ValidationError, match=r"greater than or equal to 0\.1"):
        TypeAdapter[Task](Task).validate_python({**CIRCLE, "speed_m_s": speed_m_s})
    with pytest.raises(ValidationError, match=r"greater than or equal to 0\.1"):
        TaskTerms(speed_m_s=speed_m_s)


@pytest.mark.parametrize(
    ("changes", "least"),
    [({"type": "change_speed", "speed_m_s": 1e-200}, "0.1"), ({"acceptance_radius_m": 1e-200}, "0.01")],
)
def test_so_has_a_plan(changes: dict[str, object], least: str) -> None:
    plan = json.loads((PLANS / "multicopter-embedded.json").read_text(encoding="utf-8"))
    takeoff, place, *rest = plan["items"]
    items = [takeoff, {"id": "slow", **changes}, place] if "type" in changes else [takeoff, {**place, **changes}]
    with pytest.raises(PlanInvalid) as refused:
        parse_plan(json.dumps({**plan, "items": [*items, *rest]}))
    (finding,) = refused.value.findings
    assert (finding.code, f"at least {least}" in finding.message) == ("plan.out_of_range", True)
