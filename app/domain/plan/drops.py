"""The drops of a plan: their position, who commands them, and whether the vehicle can stop there."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

from app.domain.geo import LatLon
from app.domain.items import Delay, Drop, DropItem, Gripper, PlanItem, Waypoint
from app.domain.items.drop_places import Alternate
from app.domain.plan.document import Plan
from app.domain.plan.walk import Step, walk
from app.domain.validation.finding import json_pointer
from app.domain.vehicle.state import FlightRegime, GlobalPosition, InFlight

CAN_HOLD = frozenset({FlightRegime.GROUND, FlightRegime.ROTARY_WING, FlightRegime.WHEELS})
"""Flight regimes in which a vehicle can stop. A fixed wing or an airship cannot."""

CAN_GO_ON = frozenset({FlightRegime.ROTARY_WING, FlightRegime.WHEELS})
"""Flight regimes in which a vehicle can continue to an alternate with a waypoint alone: not on the ground."""


@dataclass(frozen=True, slots=True)
class DropUse:
    """A drop of the walk. `anchor` is its position step, None if it follows none. `first`: first drop at that position.

    `delayed`: a delay item precedes it at that position. `prepared`: a photo or a speed change precedes
    it there.
    """

    step: Step
    item: DropItem
    anchor: Step | None
    first: bool
    supervised: bool
    delayed: bool = False
    prepared: bool = False

    @property
    def releases(self) -> bool:
        """Whether the drop releases a parcel. Only such a drop has an outcome, a grab or a retract does not."""
        return self.item.releases

    @property
    def alternate(self) -> Alternate | None:
        """The alternate, if possible: for a supervised release in the air or on wheels."""
        reachable = self.supervised and self.releases and self.anchor is not None and self.carried in CAN_GO_ON
        return self.item.other_place() if reachable else None

    @property
    def stopped(self) -> bool:
        """Whether the plan requires the vehicle to be stopped at the drop."""
        return self.item.release_motion == "stopped"

    @property
    def carried(self) -> FlightRegime:
        """The flight regime during the drop."""
        return self.step.before

    @property
    def can_hold(self) -> bool:
        """Whether the vehicle can stop there."""
        return self.carried in CAN_HOLD


def drops_of(steps: Iterable[Step]) -> tuple[DropUse, ...]:
    """Return the drops of a walk, in order."""
    found: list[DropUse] = []
    stop: Step | None = None
    last: Step | None = None
    between: list[PlanItem] = []
    for step in steps:
        if isinstance(step.item, Drop):
            anchor = stop if step.anchor is not None else None
            first = last is None or last.anchor != step.anchor or step.index < last.index
            delayed = any(item.waits for item in between)
            prepared = any(item.stays and not item.waits for item in between)
            supervised = is_supervised(step.item, step.before)
            found.append(DropUse(step, step.item, anchor, first, supervised, delayed, prepared))
            last, between = step, []
        elif step.anchor == step.index:
            stop, last, between = step, None, []
        else:
            between.append(step.item)
    return tuple(found)


def is_supervised(item: Drop, carried: FlightRegime) -> bool:
    """Whether Waydrop commands this drop. Default: a gripper release wherever the vehicle can stop.

    A winch is embedded by default, because PX4 executes no winch command: an external payload must receive the mission
    item. A grab is always embedded.
    """
    if item.grabs:
        return False
    if item.mode is not None:
        return item.mode == "supervised"
    return item.usually_supervised and item.release_motion == "stopped" and carried in CAN_HOLD


# The detour: the flight in which every drop with an alternate fails.
#
# Rules and prediction treat it like any other plan, so they also cover the legs to the alternates.


LEAVE_S: Final = 5.0
"""How much longer than `hold_s` a drop with an alternate holds: time to detect the failure, store it, and advance the
vehicle.
"""


@dataclass(frozen=True, slots=True)
class Detour:
    """The plan over its alternates. `pointers` are the JSON Pointers of its items into the original plan, `drops` the
    drops that fail, by the ID of their alternate.
    """

    plan: Plan
    pointers: tuple[str, ...]
    drops: dict[str, str]


def over_alternates(plan: Plan, home: GlobalPosition, in_flight: InFlight | None = None) -> Detour | None:
    """Return the detour, None if no drop of the plan has a usable alternate.

    A drop that fails becomes a wait for its whole hold. Waypoint and drop of an alternate have the alternate's ID.
    """
    if not plan.alternates:
        return None
    failing = {
        drop.step.index: drop for drop in drops_of(walk(plan, home, in_flight=in_flight)) if drop.alternate is not None
    }
    if not failing:
        return None
    items: list[PlanItem] = []
    pointers: list[str] = []
    for index, item in enumerate(plan.items):
        pointer = json_pointer("items", index)
        drop = failing.get(index)
        if drop is None:
            items.append(item)
            pointers.append(pointer)
            continue
        assert drop.alternate is not None
        _wait_instead(items, drop)
        pointers += [pointer] * (len(items) - len(pointers))
        items += alternate_items(drop.alternate)
        pointers += [f"{pointer}/alternate"] * 2
    drops = {drop.alternate.id: drop.item.id for drop in failing.values() if drop.alternate is not None}
    return Detour(plan.model_copy(update={"items": tuple(items)}), tuple(pointers), drops)


def alternate_items(alternate: Alternate) -> tuple[Waypoint, Gripper]:
    place = alternate.model_dump(include=set(Waypoint.model_fields) & set(Alternate.model_fields) - {"hold_s"})
    terms = alternate.model_dump(include={"id", "hold_s", "max_offset_m", "consent", "consent_timeout_s"})
    drop = Gripper(type="gripper", action="release", release_motion="stopped", mode="supervised", **terms)
    return Waypoint(type="waypoint", **place), drop


def alternate_drop(drop: DropUse, home: GlobalPosition) -> DropUse | None:
    """Return the drop at the alternate for the compiler, None without an alternate."""
    if drop.alternate is None or drop.anchor is None:
        return None
    place, gripper = alternate_items(drop.alternate)
    start = drop.anchor.end
    end: LatLon = place.end_of(home, start)
    there = Step(drop.step.index, place, drop.carried, drop.carried, start, end, drop.step.index)
    return DropUse(replace(there, item=gripper, start=end), gripper, there, first=True, supervised=True)


def _wait_instead(items: list[PlanItem], drop: DropUse) -> None:
    """Return the hold of the failed drop: at its waypoint if that holds, else a delay."""
    hold_s = drop.item.hold_s + LEAVE_S
    place = items[-1]
    if drop.carried is FlightRegime.ROTARY_WING and place.holds():
        items[-1] = place.model_copy(update={"hold_s": max(place.hovers_s(), hold_s)})
    else:
        items.append(Delay(type="delay", id=drop.item.id, duration_s=hold_s))
