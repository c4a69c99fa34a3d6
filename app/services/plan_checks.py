"""Checks of plans: pure functions, which the worker process can run. It imports this module, so keep it small."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from app.domain.model import Frozen
from app.domain.plan import Plan, PlanInvalid, parse_data, plan_hash
from app.domain.plan.walk import reference_home
from app.domain.prediction import CALM, Timeline, Wind
from app.domain.rules import Finding, Severity, check_plan, checked
from app.domain.vehicle.state import VehicleProfile


class PlanCheck(Frozen):
    """What was found in a plan, and the flight that is predicted; None where there is no flight to predict.

    `parameters_age_s`: the age of the vehicle's parameters that it was checked against in seconds; null without a
    vehicle, or if they were not read since the link was lost.
    """

    findings: tuple[Finding, ...]
    timeline: Timeline | None
    parameters_age_s: float | None = None

    @property
    def has_errors(self) -> bool:
        """Whether the plan is refused."""
        return any(finding.severity is Severity.ERROR for finding in self.findings)


def check(plan: Plan, facts: VehicleProfile | None, wind: Wind) -> PlanCheck:
    """Findings and timeline for a vehicle, or for the type's defaults."""
    age_s = None if facts is None or facts.parameters_age_s is None else round(facts.parameters_age_s, 1)
    found = checked(plan, facts, wind)
    return PlanCheck(findings=found.findings, timeline=found.timeline, parameters_age_s=age_s)


def check_and_hash(plan: Plan) -> tuple[PlanCheck, str]:
    """What is found without a vehicle, and the hash of the plan."""
    return check(plan, None, CALM), plan_hash(plan)


def check_as_json(document: object, facts: VehicleProfile | None, wind: Wind) -> bytes:
    """The PlanCheck of a document that need not be a plan, as JSON: bytes cost the event loop nothing to receive."""
    try:
        found = check(parse_data(document), facts, wind)
    except PlanInvalid as error:
        found = PlanCheck(findings=error.findings, timeline=None)
    return found.model_dump_json().encode()


def is_plan(document: object) -> bool:
    try:
        parse_data(document)
    except PlanInvalid:
        return False
    return True


def rules_at_best(plan: Plan, facts: VehicleProfile, wind: Wind) -> tuple[tuple[Finding, ...], frozenset[str]]:
    """What the rules find, and the codes of its errors that stay with a full battery at the plan's own home."""
    findings = check_plan(plan, facts, wind)
    if not (errors := _errors(findings)):
        return findings, errors
    home = None if plan.home is None else reference_home(plan, None)
    return findings, _errors(check_plan(plan, replace(facts, battery_percent=100.0, home=home), wind))


def _errors(findings: Sequence[Finding]) -> frozenset[str]:
    return frozenset(finding.code for finding in findings if finding.severity is Severity.ERROR)
