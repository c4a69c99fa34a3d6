"""What a rule is. Rules are data: they are checked, documented and tested one by one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, TypeVar

from app.domain.airspace.fence_route import FenceRoutes
from app.domain.airspace.geofence import FenceArea
from app.domain.autopilot import Autopilot, Behaviour, autopilot, behaviour
from app.domain.geo import LocalProjection
from app.domain.items import PlanItem
from app.domain.items.fields import Altitude
from app.domain.plan.document import Plan
from app.domain.plan.drops import DropUse
from app.domain.plan.walk import Step, reference_home
from app.domain.prediction import Timeline
from app.domain.prediction.motion import Wind
from app.domain.validation.finding import Finding, Severity, json_pointer
from app.domain.vehicle.state import GlobalPosition, VehicleProfile

Value = TypeVar("Value")


class Assumptions:
    """Collects the names of assumed facts since the last `clear`."""

    def __init__(self) -> None:
        self._names: set[str] = set()

    def add(self, name: str) -> None:
        """Record that this fact was requested and is unknown."""
        self._names.add(name)

    def clear(self) -> None:
        """Forget all assumptions."""
        self._names.clear()

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names in alphabetical order."""
        return tuple(sorted(self._names))

    def remembered(self, make: Callable[[], Value]) -> Callable[[], Value]:
        """Return a function that calls `make` once. Each caller inherits the assumptions of the value."""
        kept: list[tuple[Value, tuple[str, ...]]] = []

        def value() -> Value:
            if not kept:
                before, self._names = self._names, set()
                made = make()
                kept.append((made, self.names))
                self._names = before
            made, names = kept[0]
            self._names.update(names)
            return made

        return value


MOST_NAMED: Final = 3
"""Maximum number of assumed facts in a message."""


@dataclass(frozen=True, slots=True)
class RuleContext:
    """The input of every rule. `facts` are the vehicle's; without a vehicle of the plan's type they are all unknown.

    `origin` is `home` without recording an assumption, `projection` is around it. Rules request facts of the vehicle
    here, above all through `behaviour`, so `assumptions` records what was assumed. Expensive values are computed on
    first use. `seqs_of`: the mission items of each plan item, empty if the plan has no mission.
    """

    plan: Plan
    vehicle: VehicleProfile | None
    facts: VehicleProfile
    assumptions: Assumptions
    origin: GlobalPosition
    steps: tuple[Step, ...]
    drops: tuple[DropUse, ...]
    projection: LocalProjection
    fence_area: Callable[[], FenceArea | None]
    fence_routes: Callable[[], FenceRoutes | None]
    flown_speeds_m_s: Callable[[], tuple[float, ...]]
    wind: Wind
    timeline: Callable[[], Timeline]
    seqs_of: Callable[[], Mapping[str, Sequence[int]]]

    @property
    def is_for_any(self) -> bool:
        """Whether no vehicle of the plan's type is given."""
        return self.vehicle is None or self.vehicle.vehicle_type is not self.plan.vehicle_type

    @property
    def autopilot(self) -> Autopilot:
        return autopilot(self.facts.autopilot)

    @property
    def behaviour(self) -> Behaviour:
        """The behaviour of the vehicle, by its facts and by assumptions."""
        return behaviour(self.facts)

    @property
    def knows_home(self) -> bool:
        """Whether the vehicle or the plan specifies home."""
        return self.facts.home is not None or self.plan.home is not None

    @property
    def home(self) -> GlobalPosition:
        """The start position. Without a known home, the first position of the plan is assumed."""
        return reference_home(self.plan, self.facts)

    @property
    def fence(self) -> FenceArea | None:
        """None if the plan has no geofence."""
        return self.fence_area()

    @property
    def speeds_m_s(self) -> tuple[float, ...]:
        """The ground speed at the end of each step, in calm air."""
        return self.flown_speeds_m_s()

    def knows_height(self, altitude: Altitude) -> bool:
        """Whether the height above home is known. The altitude of home is never assumed."""
        return altitude.relative_altitude_m is not None or self.knows_home


@dataclass(frozen=True, slots=True)
class Violation:
    """A location where a rule is violated, and how to fix it. Code and severity belong to the rule.

    `assumed`: assumptions besides those that the rule has recorded.
    """

    pointer: str
    message: str
    hint: str
    item_id: str | None = None
    assumed: tuple[str, ...] = ()


Check = Callable[[RuleContext], Iterator[Violation]]


@dataclass(frozen=True, slots=True)
class Rule:
    """`reason` explains the rule. `source` is its origin: a check of PX4, a test flight, or Waydrop."""

    code: str
    severity: Severity
    reason: str
    source: str
    check: Check

    def findings(self, context: RuleContext) -> Iterator[Finding]:
        """Return all violations of the rule in a plan."""
        context.assumptions.clear()
        for broken in self.check(context):
            assumed = tuple(sorted({*context.assumptions.names, *broken.assumed}))
            yield Finding(
                code=self.code,
                severity=Severity.WARNING if assumed and context.is_for_any else self.severity,
                pointer=broken.pointer,
                message=_sentence(broken.message, assumed, for_any=context.is_for_any),
                hint=broken.hint,
                item_id=broken.item_id,
                assumed=assumed,
            )


class RuleSet:
    """The rules of one file, in their order. Its methods decorate a check with what is documented of it."""

    def __init__(self) -> None:
        self.all: list[Rule] = []

    def error(self, code: str, reason: str, source: str) -> Callable[[Check], Check]:
        """A rule that rejects a plan."""
        return self._rule(code, Severity.ERROR, reason, source)

    def warning(self, code: str, reason: str, source: str) -> Callable[[Check], Check]:
        """A rule that warns."""
        return self._rule(code, Severity.WARNING, reason, source)

    def _rule(self, code: str, severity: Severity, reason: str, source: str) -> Callable[[Check], Check]:
        def add(check: Check) -> Check:
            self.all.append(Rule(code, severity, reason, source, check))
            return check

        return add


def _sentence(message: str, assumed: tuple[str, ...], *, for_any: bool) -> str:
    if not assumed:
        return message
    if for_any:
        return f"depends on the vehicle: {message}"
    more = f" and {len(assumed) - MOST_NAMED} more" if len(assumed) > MOST_NAMED else ""
    return f"{message} (assumed, because the vehicle does not report it: {', '.join(assumed[:MOST_NAMED])}{more})"


def at_item(step: Step, message: str, hint: str, *path: str | int) -> Violation:
    """Return a violation at a step's item, or at one of its fields."""
    return at_index(step.index, step.item, message, hint, *path)


def at_index(index: int, item: PlanItem, message: str, hint: str, *path: str | int) -> Violation:
    return Violation(json_pointer("items", index, *path), message, hint, item.id)
