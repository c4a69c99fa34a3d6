"""What a rule is. Rules are data: a table of them is checked, documented and tested."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, TypeVar

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

# What a finding rests on: the facts that were asked for and not known while its rule was looking.


Value = TypeVar("Value")


class Assumptions:
    """Collects the names of assumed facts from one `clear` to the next."""

    def __init__(self) -> None:
        self._names: set[str] = set()

    def add(self, name: str) -> None:
        """This fact was asked for and is not known."""
        self._names.add(name)

    def clear(self) -> None:
        """What comes now rests on nothing yet."""
        self._names.clear()

    @property
    def names(self) -> tuple[str, ...]:
        """In alphabetical order."""
        return tuple(sorted(self._names))

    def remembered(self, make: Callable[[], Value]) -> Callable[[], Value]:
        """`make` as a function that is called once; whoever asks for its value rests on what the value rests on."""
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
"""Assumed facts that a sentence names."""


@dataclass(frozen=True, slots=True)
class RuleContext:
    """What every rule looks at. `facts` are the vehicle's; of None, and of a vehicle of another type, nothing is known.

    `origin` is `home` without asking for it, `projection` is around it. What depends on the vehicle is asked for here,
    above all by `behaviour`: so `assumptions` knows what was assumed. What takes long is worked out when it is first
    asked for. `seqs_of`: the mission items that each item becomes, none if the plan has none at all.
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
    flown_speeds_m_s: Callable[[], tuple[float, ...]]
    wind: Wind
    timeline: Callable[[], Timeline]
    seqs_of: Callable[[], Mapping[str, Sequence[int]]]

    @property
    def is_for_any(self) -> bool:
        """No vehicle of the plan's type is named."""
        return self.vehicle is None or self.vehicle.vehicle_type is not self.plan.vehicle_type

    @property
    def autopilot(self) -> Autopilot:
        """What flies the vehicle."""
        return autopilot(self.facts.autopilot)

    @property
    def behaviour(self) -> Behaviour:
        """What the vehicle does, by what it tells and what is assumed of it."""
        return behaviour(self.facts)

    @property
    def knows_home(self) -> bool:
        """Whether the vehicle or the plan tells it."""
        return self.facts.home is not None or self.plan.home is not None

    @property
    def home(self) -> GlobalPosition:
        """Where it starts; assumed at the first place of the plan if nobody tells it."""
        return reference_home(self.plan, self.facts)

    @property
    def fence(self) -> FenceArea | None:
        """None when the plan has none."""
        return self.fence_area()

    @property
    def speeds_m_s(self) -> tuple[float, ...]:
        """At the end of each step, over ground without wind."""
        return self.flown_speeds_m_s()

    def knows_height(self, altitude: Altitude) -> bool:
        """Whether it can be said how high above home this is: nobody guesses how high home lies."""
        return altitude.relative_altitude_m is not None or self.knows_home


@dataclass(frozen=True, slots=True)
class Violation:
    """Where a rule is broken and how to mend it; code and severity are the rule's.

    `assumed`: what this one rests on besides what the rule asked for until now.
    """

    pointer: str
    message: str
    hint: str
    item_id: str | None = None
    assumed: tuple[str, ...] = ()


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


def _sentence(message: str, assumed: tuple[str, ...], *, for_any: bool) -> str:
    if not assumed:
        return message
    if for_any:
        return f"depends on the vehicle: {message}"
    more = f" and {len(assumed) - MOST_NAMED} more" if len(assumed) > MOST_NAMED else ""
    return f"{message} (assumed, for the vehicle does not tell: {', '.join(assumed[:MOST_NAMED])}{more})"


def at_item(step: Step, message: str, hint: str, *path: str | int) -> Violation:
    """A violation of a step's item, or of one of its fields."""
    return at_index(step.index, step.item, message, hint, *path)


def at_index(index: int, item: PlanItem, message: str, hint: str, *path: str | int) -> Violation:
    """The same for an item that is known by its index."""
    return Violation(json_pointer("items", index, *path), message, hint, item.id)
