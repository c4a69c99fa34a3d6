"""A whole file as plan fields, and the plan that becomes of it. Findings keep their places in the file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from app.domain.items import Loiter, PlanItem
from app.domain.plan import Plan, PlanInvalid, parse_plan
from app.domain.plan.compiler import EMBEDDED_HOLD_S, brakes_at_waypoint, holds_apart, stop_radius_m
from app.domain.plan.drops import DropUse, drops_of
from app.domain.plan.json_tree import MAX_FIELDS
from app.domain.plan.walk import reference_home, walk
from app.domain.prediction.durations import COMES_TO_REST_S
from app.domain.validation.finding import Finding
from app.domain.vehicle.state import FlightRegime
from app.interchange.findings import FileObject, Report
from app.interchange.item_draft import ItemDraft, ItemExtra
from app.interchange.qgc_format import EXTRA, EXTRA_VERSION


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
    """Set for each drop without it whether the vehicle stops: it does wherever it can."""
    if not any(draft.motion_assumed for draft in drafts):
        return plan
    drops = {drop.step.index: drop for drop in drops_of(walk(plan, reference_home(plan, None)))}
    items: list[PlanItem] = list(plan.items)
    for index, draft in enumerate(drafts):
        if draft.motion_assumed:
            motion = "stopped" if _stands(drops[index]) else "moving"
            items[index] = items[index].model_copy(update={"release_motion": motion})
            _report_motion(draft, motion, report)
            _report_braking(drops[index], drafts, report)
    return plan.model_copy(update={"items": tuple(items)})


def _report_braking(drop: DropUse, drafts: Sequence[ItemDraft], report: Report) -> None:
    """PX4 stops at a waypoint only for hold and radius together, and ends a loiter before its point: without them the
    file's own drop is a moving one.
    """
    if drop.anchor is None or not drop.first:
        return
    place = drop.anchor.item
    brakes = place.hovers_s() >= EMBEDDED_HOLD_S and place.reach_m() == stop_radius_m(place.reach_m())
    hovers = drop.delayed or (isinstance(place, Loiter) and (place.duration_s or 0.0) >= COMES_TO_REST_S)
    if (brakes_at_waypoint(drop) and not brakes) or (holds_apart(drop) and not hovers):
        message = (
            "as in the file, the vehicle would not stop here and would release about 10 m before; Waydrop makes it stop"
        )
        hint = 'use "release_motion": "moving" to keep the behaviour of the file'
        report.assume("conversion.braking", drafts[drop.anchor.index].pointer, message, hint)


def _stands(drop: DropUse) -> bool:
    """A rover rolls through its waypoints: it stands only in a delay."""
    return drop.can_hold and (drop.carried is not FlightRegime.WHEELS or drop.delayed)


def _report_motion(draft: ItemDraft, motion: str, report: Report) -> None:
    standing = {
        "stopped": 'the file does not specify whether the vehicle stops for the drop; it can, so "stopped" is assumed',
        "moving": 'the vehicle does not stop here, so the drop is read as "moving"',
    }
    hint = (
        'the mission releases the parcel, as in the file; with "mode": "supervised" Waydrop checks before the release'
    )
    report.assume("conversion.release_motion", draft.pointer, standing[motion], hint if motion == "stopped" else "")


# What the `waydrop` objects of a file add to it, and what they must not say.
#
# A person who opens the file in other software sees its own fields and not Waydrop's: where the vehicle flies and what
# it drops is
# said there alone. Ours may put back only what Waydrop itself had to write differently. The one exception is an
# alternate, which no other software supports: the reader gets a finding.


_REPLACED: Final = frozenset({"hold_s", "acceptance_radius_m", "mode"})
"""Fields of an item that a drop needs to be written otherwise than the plan has them."""
_EMPTIED: Final = frozenset({"latitude_deg", "longitude_deg", "pitch_deg", "speed_type", "approach"})
"""Fields that the plan leaves open and a file does not: they may only be put back to null."""
_NEVER: Final = frozenset({"version", "vehicle_type", "items", "geofence"})


def apply_item_extra(draft: ItemDraft, extra: ItemExtra, report: Report) -> None:
    """Puts the fields in, unless one of the places that they stand for was changed since."""
    draft.id = extra.id
    if extra.id:
        draft.places["id"] = extra.pointer + "/id"
    written = extra.written or {}
    changed = [name for name, value in written.items() if draft.fields.get(name) != value]
    for name, value in (extra.fields or {}).items():
        pointer = f"{extra.pointer}/fields/{name}"
        is_ours = name not in draft.fields or (name in written and _may_replace(name, value))
        if name in ("id", "type") or not is_ours:
            message = f"the {name} of an item is already in the item"
            report.refuse("conversion.extra", pointer, message, "remove it here")
        elif name not in written or not changed:
            draft.fields[name] = value
            draft.places[name] = pointer
            _name_hidden_place(name, value, pointer, report)
    if changed:
        message = f"{', '.join(changed)} was changed since Waydrop wrote this file: the values of the item are used"
        report.assume("conversion.changed_since", extra.pointer, message)


def _name_hidden_place(name: str, value: Any, pointer: str, report: Report) -> None:
    """The one place that is ours alone: where the parcel goes if its drop fails."""
    if name == "alternate" and value is not None:
        message = "the drop has an alternate, a position that other software does not show: check it before the flight"
        report.assume("conversion.alternate", pointer, message)


def _may_replace(name: str, value: Any) -> bool:
    return name in _REPLACED or (name in _EMPTIED and value is None)


def apply_plan_extra(top: FileObject, draft: PlanDraft, report: Report) -> None:
    """The `waydrop` object of the file: each field is used unless the corresponding value of the file was edited."""
    value = top.typed(EXTRA, dict, required=False)
    if value is None:
        return
    extra = FileObject(value, top.at(EXTRA), report)
    for key in sorted(set(value) - {"version", "fields", "written"}):
        report.refuse("conversion.extra", extra.at(key), f"a waydrop object has no given {key!r}")
    extra.version(EXTRA_VERSION)
    written = extra.typed("written", dict, required=False) or {}
    fields = extra.typed("fields", dict, required=False) or {}
    if len(fields) > MAX_FIELDS:  # each is looked up among all places of the file
        message = f"{len(fields)} fields; a plan has at most {MAX_FIELDS}"
        report.refuse("conversion.too_large", extra.at("fields"), message)
        return
    for name, given in fields.items():
        pointer = f"{extra.pointer}/fields/{name}"
        own = draft.fields.get(name)
        if name in written and own != written[name]:
            message = f"{name} was changed since Waydrop wrote this file: the value of the file is used"
            report.assume("conversion.changed_since", pointer, message)
        elif name in _NEVER or (own and name != "name" and not (name in written and _same_places(name, own, given))):
            message = f"the {name} of a plan is already in the file"
            report.refuse("conversion.extra", pointer, message, "remove it here")
        else:
            draft.fields[name] = given
            draft.places = _without(draft.places, f"/{name}") | {f"/{name}": pointer}


def _same_places(name: str, own: Any, field: Any) -> bool:
    """Rally points may get another altitude and no other place; a home may only be left open."""
    if name == "home":
        return field is None
    if name != "rally_points" or not isinstance(field, list):
        return False
    return [_place(point) for point in own] == [_place(point) for point in field]


def _place(point: Any) -> tuple[Any, Any] | None:
    return (point.get("latitude_deg"), point.get("longitude_deg")) if isinstance(point, dict) else None


def _without(places: dict[str, str], pointer: str) -> dict[str, str]:
    below = pointer + "/"
    return {place: target for place, target in places.items() if place != pointer and not place.startswith(below)}
