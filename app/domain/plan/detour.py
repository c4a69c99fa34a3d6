"""The way over the alternates: the flight in which every drop that has another place fails at its own.

Rules and prediction look at this plan as at any other, so that they hold for the legs to the alternates too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from app.domain.carried import Carried
from app.domain.finding import json_pointer
from app.domain.geo import Place
from app.domain.in_flight import InFlight
from app.domain.items import Delay, Gripper, PlanItem, Waypoint
from app.domain.items.alternate import Alternate
from app.domain.plan.document import Plan
from app.domain.plan.drops import DropUse, drops_of
from app.domain.plan.walk import Step, walk
from app.domain.vehicle import GlobalPosition

LEAVE_S: Final = 5.0
"""How much longer than `hold_s` a drop with an alternate holds: the time to find that it failed, to store that, and to
send the vehicle on."""


@dataclass(frozen=True, slots=True)
class Detour:
    """The plan over its alternates. `pointers` are the JSON pointers of its items into the plan as it was written, and
    `drops` the drops that fail in it, by the id of their alternate.
    """

    plan: Plan
    pointers: tuple[str, ...]
    drops: dict[str, str]


def over_alternates(plan: Plan, home: GlobalPosition, in_flight: InFlight | None = None) -> Detour | None:
    """None if no drop of the plan has an alternate that can be flown to.

    A drop that fails is a wait for its whole hold. Place and drop of an alternate both have the alternate's id.
    """
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
    """An alternate as the two items that it stands for."""
    place = alternate.model_dump(include=set(Waypoint.model_fields) & set(Alternate.model_fields) - {"hold_s"})
    terms = alternate.model_dump(include={"id", "hold_s", "max_offset_m", "consent", "consent_timeout_s"})
    drop = Gripper(type="gripper", action="release", release_motion="stopped", mode="supervised", **terms)
    return Waypoint(type="waypoint", **place), drop


def alternate_drop(drop: DropUse, home: GlobalPosition) -> DropUse | None:
    """The drop at the other place, as the compiler takes it; None if there is none."""
    if drop.alternate is None or drop.anchor is None:
        return None
    place, gripper = alternate_items(drop.alternate)
    start = drop.anchor.end
    end: Place = place.end_of(home, start)
    there = Step(drop.step.index, place, drop.carried, drop.carried, start, end, drop.step.index)
    return DropUse(replace(there, item=gripper, start=end), gripper, there, first=True, supervised=True)


def _wait_instead(items: list[PlanItem], drop: DropUse) -> None:
    """The failed drop's hold: at its waypoint, if it is that which holds, else a delay."""
    hold_s = drop.item.hold_s + LEAVE_S
    place = items[-1]
    if drop.carried is Carried.ROTARY_WING and place.holds():
        items[-1] = place.model_copy(update={"hold_s": max(place.hovers_s(), hold_s)})
    else:
        items.append(Delay(type="delay", id=drop.item.id, duration_s=hold_s))
