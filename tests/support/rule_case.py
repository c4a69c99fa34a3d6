"""A rule's test case: a plan that breaks the rule and the nearest plan that does not."""

from __future__ import annotations

from dataclasses import dataclass

from app.domain.plan import Plan
from app.domain.prediction import CALM, Wind
from app.domain.rules import check_plan
from app.domain.vehicle.state import VehicleProfile


@dataclass(frozen=True)
class Case:
    """`code` is found in `wrong`, at `pointer`, and not in `right`. Facts and wind of both, if they are needed."""

    code: str
    pointer: str
    wrong: Plan
    right: Plan
    wrong_facts: VehicleProfile | None = None
    right_facts: VehicleProfile | None = None
    about: str = ""
    wrong_wind: Wind = CALM
    right_wind: Wind = CALM

    def __str__(self) -> str:
        return f"{self.code} {self.about}".strip()


def codes(plan: Plan, facts: VehicleProfile | None = None, wind: Wind = CALM) -> set[str]:
    """The codes of all findings."""
    return {finding.code for finding in check_plan(plan, facts, wind)}


def errors(plan: Plan, facts: VehicleProfile | None = None) -> list[str]:
    """The codes of the errors, in order."""
    return [finding.code for finding in check_plan(plan, facts) if finding.severity == "error"]
