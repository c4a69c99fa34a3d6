"""A whole file as plan fields, and the plan that becomes of it. Findings keep their places in the file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from app.domain.carried import Carried
from app.domain.compiler.drop_items import EMBEDDED_HOLD_S, brakes_at_waypoint, stop_radius_m
from app.domain.finding import Finding
from app.domain.plan import Plan, PlanInvalid, PlanItem, parse_plan
from app.domain.plan.drops import DropUse, drops_of
from app.domain.plan.walk import reference_home, walk
from app.interchange.findings import Report
from app.interchange.item_draft import ItemDraft


@dataclass(slots=True)
class PlanDraft:
    """`fields` are those of the plan without its items; `places` leads from pointers of the plan to the file's."""

    fields: dict[str, Any]
    places: dict[str, str] = field(default_factory=dict)
    items: list[ItemDraft] = field(default_factory=list)
    items_place: str = ""


def finish(draft: PlanDraft, report: Report) -> Plan:
    """The plan. Raises ConversionRefused with all that is wrong, by its place in the file."""
    items = [{"type": item.type, "id": item.id, **item.fields} for item in draft.items]
    report.stop_if_refused()
    try:
        plan = parse_plan({**draft.fields, "items": items})
    except PlanInvalid as error:
        places = _places(draft)
        report.refusals += [_moved(finding, places) for finding in error.findings]
        report.stop_if_refused()
        raise
    return _with_motion(plan, draft.items, report)


def _places(draft: PlanDraft) -> dict[str, str]:
    places = {"/items": draft.items_place, **draft.places}
    for index, item in enumerate(draft.items):
        places[f"/items/{index}"] = item.pointer
        places |= {f"/items/{index}/{name}": place for name, place in item.places.items()}
    return places


def _moved(finding: Finding, places: dict[str, str]) -> Finding:
    """The finding at the nearest place that the file has for it."""
    pointer = finding.pointer
    while pointer and pointer not in places:
        pointer = pointer.rpartition("/")[0]
    return finding.model_copy(update={"pointer": places.get(pointer, ""), "item_id": None})


def _with_motion(plan: Plan, drafts: Sequence[ItemDraft], report: Report) -> Plan:
    """Says for each drop that does not say it whether the vehicle stands: it does wherever it can."""
    if not any(draft.motion_assumed for draft in drafts):
        return plan
    drops = {drop.step.index: drop for drop in drops_of(walk(plan, reference_home(plan, None)))}
    items: list[PlanItem] = list(plan.items)
    for index, draft in enumerate(drafts):
        if draft.motion_assumed:
            motion = "stopped" if _stands(drops[index]) else "moving"
            items[index] = items[index].model_copy(update={"release_motion": motion})
            _say(draft, motion, report)
            _say_braking(drops[index], drafts, report)
    return plan.model_copy(update={"items": tuple(items)})


def _say_braking(drop: DropUse, drafts: Sequence[ItemDraft], report: Report) -> None:
    """PX4 stops at a waypoint only for hold and radius together: without them the file's own drop is a moving one."""
    place = drop.anchor.item if drop.anchor is not None else None
    if drop.anchor is None or place is None or not brakes_at_waypoint(drop):
        return
    if place.hovers_s() < EMBEDDED_HOLD_S or place.reach_m() != stop_radius_m(place.reach_m()):
        message = "flown as it is, the vehicle would not stop here and drop some 10 m before; Waydrop makes it stop"
        hint = 'with "release_motion": "moving" the drop stays as the file has it'
        report.assume("conversion.braking", drafts[drop.anchor.index].pointer, message, hint)


def _stands(drop: DropUse) -> bool:
    """A rover rolls through its waypoints: it stands only in a delay."""
    return drop.can_hold and (drop.carried is not Carried.WHEELS or drop.delayed)


def _say(draft: ItemDraft, motion: str, report: Report) -> None:
    standing = {
        "stopped": 'the file does not say that the vehicle stands while it drops; it can, so "stopped" is assumed',
        "moving": 'the vehicle does not stand here, so the drop is read as "moving"',
    }
    hint = 'the mission itself drops, as the file says; with "mode": "supervised" Waydrop looks before it releases'
    report.assume("conversion.release_motion", draft.pointer, standing[motion], hint if motion == "stopped" else "")
