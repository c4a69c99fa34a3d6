"""What Waydrop accepts for a vehicle, that vehicle's autopilot accepts: two implementations of PX4's rules agree."""

from __future__ import annotations

from hypothesis import HealthCheck, given, settings

from app.domain.plan.compiler import compile_plan
from app.domain.rules import check_plan
from app.domain.validation.finding import Severity
from tests.contract.feasibility.autopilot import facts_of, refusals
from tests.support.plans_and_vehicles import Case, cases

MANY = settings(max_examples=300, deadline=None, suppress_health_check=list(HealthCheck))


def test_whatever_waydrop_accepts_the_autopilot_neither_refuses_nor_finds_infeasible() -> None:
    accepted = 0

    @MANY
    @given(cases())
    def agree(case: Case) -> None:
        nonlocal accepted
        facts = facts_of(case.plan.vehicle_type, case.params, case.profile)
        if any(finding.severity is Severity.ERROR for finding in check_plan(case.plan, facts)):
            return
        accepted += 1
        assert refusals(compile_plan(case.plan, facts), case.plan.vehicle_type, case.params, case.profile) == []

    agree()
    assert accepted > 30, "too few plans were accepted to show anything"
