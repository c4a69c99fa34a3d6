"""Parses JSON to a Plan, or raises PlanInvalid with findings."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Set
from functools import cache
from typing import Annotated, Any, Final, TypeGuard

from pydantic import Field, TypeAdapter, ValidationError

from app.domain.items import PlanItem
from app.domain.plan.document import FenceCircle, FencePolygon, Plan, RallyPoint
from app.domain.plan.json_tree import (
    MAX_FINDINGS,
    MAX_ITEMS,
    MAX_VERTICES,
    JsonTree,
    read_at_once,
    read_data,
    read_json,
)
from app.domain.validation import findings_of
from app.domain.validation.finding import Finding, Severity, UnfitDocumentError, json_pointer

# Cheap check whether a document can be a plan at all.
#
# pydantic reports every error and blocks the event loop meanwhile, even from a thread. A million errors would stall
# setpoint streams, so a document that is far from a plan is rejected before pydantic sees it.


MAX_ENTRIES: Final = max(MAX_ITEMS, MAX_VERTICES)
_REMEDY: Final = "remove it, or see `waydrop schema`"
Place = tuple[str | int, ...]


def long_lists(value: Any) -> list[Finding]:
    """The lists of a plan that are far too long. Called before anything is copied: to copy them takes long."""
    if not isinstance(value, Mapping):
        return []
    fence = value.get("geofence")
    parts: list[tuple[Place, Any]] = [((name,), value.get(name)) for name in _LISTS]
    if isinstance(fence, Mapping):
        parts += [(("geofence", name), fence.get(name)) for name in _FENCES]
    polygons = fence.get("polygons") if isinstance(fence, Mapping) else None
    if isinstance(polygons, list) and not _is_long(polygons):
        parts += [
            (("geofence", "polygons", index, "vertices"), polygon.get("vertices"))
            for index, polygon in enumerate(polygons)
            if isinstance(polygon, Mapping)
        ]
    return [_too_long(place, entries) for place, entries in parts if _is_long(entries)][:MAX_FINDINGS]


def _is_long(entries: object) -> TypeGuard[list[Any]]:
    return isinstance(entries, list) and len(entries) > MAX_ENTRIES


def _too_long(place: Place, entries: list[Any]) -> Finding:
    message = f"{len(entries)} {place[-1]}; the limit is {MAX_ENTRIES}"
    return Finding(code="plan.too_many_items", severity=Severity.ERROR, pointer=json_pointer(*place), message=message)


def check_outline(tree: JsonTree, known: Callable[[], Set[str]]) -> None:
    """Records structural errors: not an object, lists that are far too long, or MAX_FINDINGS unknown fields.

    `known` are the names of all fields of the format. A few errors are left to the validation by models.
    """
    if not isinstance(tree.value, dict):
        tree.refuse("plan.not_an_object", "", "a plan is a JSON object")
        return
    names = known()
    strange = JsonTree()
    for place, value in _places(tree.value, names):
        if _is_long(value):
            tree.add([_too_long(place, value)])
        if isinstance(place[-1], str) and place[-1] not in names:
            strange.refuse("plan.unknown_field", json_pointer(*place), f"unknown field {place[-1]!r}", _REMEDY)
        elif isinstance(place[-1], int) and not isinstance(value, dict):
            strange.refuse("plan.wrong_type", json_pointer(*place), "this must be an object")
        if len(strange.findings) + len(tree.findings) >= MAX_FINDINGS:
            tree.add(strange.findings)
            return


def _places(value: dict[str, Any] | list[Any], names: Set[str], at: Place = ()) -> Iterator[tuple[Place, Any]]:
    """Yield everything in a document with its location, except the contents of unknown fields, which pydantic skips
    too.

    The nesting is limited by JsonTree.
    """
    entries = value.items() if isinstance(value, dict) else enumerate(value[: MAX_ENTRIES + 1])
    for key, entry in entries:
        place = (*at, key)
        yield place, entry
        if isinstance(entry, (dict, list)) and (isinstance(key, int) or key in names):
            yield from _places(entry, names, place)


# Validates the entries of lists one by one, up to the maximum number of findings.
#
# pydantic blocks the event loop until it has listed all errors, which takes a second for a thousand bad items.
# Validating entry by entry avoids that.


_LIST_ENTRY: Final[TypeAdapter[Any]] = TypeAdapter(Annotated[PlanItem, Field(discriminator="type")])
_LISTS: Final[Mapping[str, TypeAdapter[Any]]] = {"items": _LIST_ENTRY, "rally_points": TypeAdapter(RallyPoint)}
_FENCES: Final[Mapping[str, TypeAdapter[Any]]] = {
    "polygons": TypeAdapter(FencePolygon),
    "circles": TypeAdapter(FenceCircle),
}


def with_entries(document: Mapping[str, Any]) -> dict[str, Any]:
    """Replace each valid entry by its model, so that nothing is validated twice.

    A list is cut after the entry that reaches MAX_FINDINGS, because the plan is invalid anyway.
    """
    made = _with_lists(document, _LISTS)
    fence = made.get("geofence")
    return {**made, "geofence": _with_lists(fence, _FENCES)} if isinstance(fence, dict) else made


def _with_lists(document: Mapping[str, Any], lists: Mapping[str, TypeAdapter[Any]]) -> dict[str, Any]:
    found = {name: document[name] for name in lists if isinstance(document.get(name), list)}
    return {**document, **{name: _validated(entries, lists[name]) for name, entries in found.items()}}


def _validated(entries: list[Any], kind: TypeAdapter[Any]) -> list[Any]:
    made: list[Any] = []
    faults = 0
    for entry in entries:
        try:
            made.append(kind.validate_python(entry))
        except ValidationError as error:
            made.append(entry)
            faults += error.error_count()
            if faults >= MAX_FINDINGS:
                break
    return made


# A valid document is validated some entries at a time: longer calls would delay setpoints of other threads.


AT_ONCE: Final = 100
"""Entries per call. With MAX_FIELDS it limits the work of one call for an invalid document."""
_AT_ONCE: Final[Mapping[str, TypeAdapter[Any]]] = {
    "items": TypeAdapter(list[Annotated[PlanItem, Field(discriminator="type")]]),
    "rally_points": TypeAdapter(list[RallyPoint]),
}


def _plan_at_once(document: Any) -> Plan | None:
    """Validate plain JSON data. Returns None if it is not a valid plan; the caller then finds out why."""
    if not isinstance(document, dict):
        return None
    fence = document.get("geofence")
    lists = [document.get("items"), document.get("rally_points"), *(fence.values() if isinstance(fence, dict) else ())]
    if any(isinstance(entries, list) and len(entries) > MAX_ITEMS for entries in lists):
        return None
    try:
        made = {name: _some_at_once(document[name], kind) for name, kind in _AT_ONCE.items() if name in document}
        return Plan.model_validate({**document, **made})
    except ValueError:  # pydantic's ValidationError is a ValueError, and so is text that cannot be encoded
        return None


def _some_at_once(entries: Any, kind: TypeAdapter[Any]) -> Any:
    if not isinstance(entries, list):
        return entries
    return [
        made
        for first in range(0, len(entries), AT_ONCE)
        for made in kind.validate_python(entries[first : first + AT_ONCE])
    ]


_CODES: Mapping[str, str] = {
    "missing": "plan.missing_field",
    "extra_forbidden": "plan.unknown_field",
    "union_tag_invalid": "plan.unknown_item_type",
    "union_tag_not_found": "plan.missing_field",
    "finite_number": "plan.not_finite",
    "greater_than": "plan.out_of_range",
    "greater_than_equal": "plan.out_of_range",
    "less_than": "plan.out_of_range",
    "less_than_equal": "plan.out_of_range",
    "string_too_short": "plan.too_short",
    "string_too_long": "plan.too_long",
    "too_short": "plan.too_few_items",
    "too_long": "plan.too_many_items",
    "string_pattern_mismatch": "plan.bad_value",
    "unprintable": "plan.bad_value",
    "literal_error": "plan.bad_value",
    "enum": "plan.bad_value",
    "null_refused": "plan.bad_value",
    "altitude_exactly_one": "plan.altitude_exactly_one",
    "half_position": "plan.half_position",
    "duplicate_id": "plan.duplicate_id",
    "loiter_kind": "plan.loiter_fields",
    "loiter_radius": "plan.out_of_range",
    "winch_length": "plan.winch_fields",
    "winch_rate": "plan.winch_fields",
}
_OTHER_CODE = "plan.wrong_type"
_ITEM: Final = re.compile(r"/items/(\d+)(?=/|$)")


class PlanInvalid(UnfitDocumentError, code="plan.invalid"):  # noqa: N818 - the public name
    """The document is not a valid plan. `findings` lists all problems at once, at most 100."""


def parse_plan(raw: bytes | str | Mapping[str, Any]) -> Plan:
    """Parse JSON text, or the object that a JSON reader returned. Raises only PlanInvalid."""
    plan = _plan_at_once(read_at_once(raw))
    if plan is not None:
        return plan
    return _plan(read_json(raw, long_lists) if isinstance(raw, bytes | str) else read_data(raw, long_lists))


def parse_data(value: Any) -> Plan:
    """Parse the output of a JSON reader. A string is a JSON value here, not JSON text. Raises PlanInvalid."""
    plan = None if isinstance(value, bytes | str) else _plan_at_once(read_at_once(value))
    return plan or _plan(read_data(value, long_lists))


def _plan(tree: JsonTree) -> Plan:
    if not tree.findings:
        check_outline(tree, _field_names)
    if tree.findings:
        raise PlanInvalid(tree.findings)
    try:
        return Plan.model_validate(with_entries(tree.value))
    except ValidationError as error:
        raise PlanInvalid(_findings(error, tree.value)) from None


@cache
def plan_json_schema() -> Mapping[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a plan. It is built once per process."""
    schema = TypeAdapter(Plan).json_schema(mode="validation")
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "Waydrop delivery plan", **schema}


@cache
def _field_names() -> frozenset[str]:
    schema = plan_json_schema()
    parts = (schema, *schema["$defs"].values())
    return frozenset(name for part in parts for name in part.get("properties", {}))


def _findings(error: ValidationError, value: Any) -> list[Finding]:
    found = findings_of(error, Plan, value, code_of=lambda kind: _CODES.get(kind, _OTHER_CODE))
    return [finding.model_copy(update={"item_id": _item_id(finding.pointer, value)}) for finding in found]


def _item_id(pointer: str, value: Any) -> str | None:
    match = _ITEM.match(pointer)
    item = value["items"][int(match[1])] if match else None
    name = item.get("id") if isinstance(item, dict) else None
    return name if isinstance(name, str) else None
