"""What the `waydrop` objects of a file add to it, and what they must not say.

A person who opens the file elsewhere sees its own places and not ours: where the vehicle goes and what it drops is said
there alone. Ours may put back only what Waydrop itself had to write differently. The one exception is an alternate,
which no other software has: whoever reads a file with one is told.
"""

from __future__ import annotations

from typing import Any, Final

from app.interchange.file_item import ItemExtra
from app.interchange.file_json import FileObject
from app.interchange.findings import Report
from app.interchange.item_draft import ItemDraft
from app.interchange.plan_draft import PlanDraft
from app.interchange.qgc_format import EXTRA, EXTRA_VERSION

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
            message = f"the {name} of an item is said by the item itself"
            report.refuse("conversion.extra", pointer, message, "take it away here")
        elif name not in written or not changed:
            draft.fields[name] = value
            draft.places[name] = pointer
            _name_hidden_place(name, value, pointer, report)
    if changed:
        message = f"{', '.join(changed)} was changed since Waydrop wrote this file: the item's own values count"
        report.assume("conversion.changed_since", extra.pointer, message)


def _name_hidden_place(name: str, value: Any, pointer: str, report: Report) -> None:
    """The one place that is ours alone: where the parcel goes if its drop fails."""
    if name == "alternate" and value is not None:
        message = "the drop has an alternate, a place that other software does not show: look at it before it is flown"
        report.assume("conversion.alternate", pointer, message)


def _may_replace(name: str, value: Any) -> bool:
    return name in _REPLACED or (name in _EMPTIED and value is None)


def apply_plan_extra(top: FileObject, draft: PlanDraft, report: Report) -> None:
    """The `waydrop` object of the file: each field counts unless what was written for it was changed since."""
    value = top.typed(EXTRA, dict, required=False)
    if value is None:
        return
    extra = FileObject(value, top.at(EXTRA), report)
    for key in sorted(set(value) - {"version", "fields", "written"}):
        report.refuse("conversion.extra", extra.at(key), f"a waydrop object has no field {key!r}")
    extra.version(EXTRA_VERSION)
    written = extra.typed("written", dict, required=False) or {}
    for name, field in (extra.typed("fields", dict, required=False) or {}).items():
        pointer = f"{extra.pointer}/fields/{name}"
        own = draft.fields.get(name)
        if name in written and own != written[name]:
            message = f"{name} was changed since Waydrop wrote this file: the file's own value counts"
            report.assume("conversion.changed_since", pointer, message)
        elif name in _NEVER or (own and name != "name" and not (name in written and _same_places(name, own, field))):
            message = f"the {name} of a plan is said by the file itself"
            report.refuse("conversion.extra", pointer, message, "take it away here")
        else:
            draft.fields[name] = field
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
    """Without a place and all below it."""
    below = pointer + "/"
    return {place: target for place, target in places.items() if place != pointer and not place.startswith(below)}
