"""What a rule is. Rules are data: a table of them is checked, documented and tested."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from app.domain.default_facts import parameter
from app.domain.fence_area import FenceArea
from app.domain.finding import Finding, Severity, json_pointer
from app.domain.geo import LocalProjection
from app.domain.plan.document import Plan
from app.domain.plan.drops import DropUse
from app.domain.plan.items import PlanItem
from app.domain.plan.walk import Step
from app.domain.prediction import Timeline
from app.domain.prediction.wind import Wind
from app.domain.vehicle import GlobalPosition, VehicleFacts


@dataclass(frozen=True, slots=True)
class RuleContext:
    """What every rule looks at. `facts` are the vehicle's, or the defaults of its type when `vehicle` is None.

    `fence` is None when the plan has none; `projection` is around home. `timeline` predicts when it is first called.
    """

    plan: Plan
    vehicle: VehicleFacts | None
    facts: VehicleFacts
    home: GlobalPosition
    steps: tuple[Step, ...]
    speeds_m_s: tuple[float, ...]
    drops: tuple[DropUse, ...]
    projection: LocalProjection
    fence: FenceArea | None
    wind: Wind
    timeline: Callable[[], Timeline]

    def parameter(self, name: str) -> float:
        """A PX4 parameter of the vehicle, or its strict default."""
        return parameter(self.facts, name)


@dataclass(frozen=True, slots=True)
class Violation:
    """Where a rule is broken and how to mend it; code and severity are the rule's."""

    pointer: str
    message: str
    hint: str
    item_id: str | None = None


Check = Callable[[RuleContext], Iterator[Violation]]


@dataclass(frozen=True, slots=True)
class Rule:
    """`reason` says why, in a sentence; `source` says who says so: a PX4 rule, a flown test, or ours."""

    code: str
    severity: Severity
    reason: str
    source: str
    check: Check

    def findings(self, context: RuleContext) -> Iterator[Finding]:
        """All places where the plan breaks this rule."""
        for broken in self.check(context):
            yield Finding(
                code=self.code,
                severity=self.severity,
                pointer=broken.pointer,
                message=broken.message,
                hint=broken.hint,
                item_id=broken.item_id,
            )


def at_item(step: Step, message: str, hint: str, *path: str | int) -> Violation:
    """A violation of a step's item, or of one of its fields."""
    return at_index(step.index, step.item, message, hint, *path)


def at_index(index: int, item: PlanItem, message: str, hint: str, *path: str | int) -> Violation:
    """The same for an item that is known by its index."""
    return Violation(json_pointer("items", index, *path), message, hint, item.id)
