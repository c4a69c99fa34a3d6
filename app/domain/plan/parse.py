"""JSON to Plan. Whatever comes in, the answer is a Plan or PlanInvalid with findings."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Set
from functools import cache
from typing import Annotated, Any, Final

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
from app.domain.validation.finding import Finding, UnfitDocumentError, json_pointer

# Whether a document can be a plan at all, seen from afar.
#
# pydantic names every fault, and holds everything else in the process up meanwhile, also from a thread: a million of
# them would cost the vehicles flown by setpoints theirs. So what is far from a plan is refused before pydantic looks.


MAX_ENTRIES: Final = max(MAX_ITEMS, MAX_VERTICES)
_MEND: Final = "remove it, or see `waydrop schema`"
Place = tuple[str | int, ...]


def check_outline(tree: JsonTree, known: Callable[[], Set[str]]) -> None:
    """Writes down what is wrong with the outline: no object, far too long lists, or MAX_FINDINGS of what no plan has.

    `known` are the names of all fields of the format. What is wrong in few places is left to the models' own check.
    """
    if not isinstance(tree.value, dict):
        tree.refuse("plan.not_an_object", "", "a plan is a JSON object")
        return
    names = known()
    strange = JsonTree()
    for place, value in _places(tree.value, names):
        if isinstance(value, list) and len(value) > MAX_ENTRIES:
            tree.refuse(
                "plan.too_many_items",
                json_pointer(*place),
                f"{len(value)} {place[-1]}, at most {MAX_ENTRIES} are taken",
            )
        if isinstance(place[-1], str) and place[-1] not in names:
            strange.refuse("plan.unknown_field", json_pointer(*place), f"unknown field {place[-1]!r}", _MEND)
        elif isinstance(place[-1], int) and not isinstance(value, dict):
            strange.refuse("plan.wrong_type", json_pointer(*place), "this must be an object")
        if len(strange.findings) + len(tree.findings) >= MAX_FINDINGS:
            tree.findings += strange.findings
            return


def _places(value: dict[str, Any] | list[Any], names: Set[str], at: Place = ()) -> Iterator[tuple[Place, Any]]:
    """Everything in a document with its place; what is in an unknown field is not looked at, as pydantic does not.

    It is not nested deeper than JsonTree allows.
    """
    entries = value.items() if isinstance(value, dict) else enumerate(value[: MAX_ENTRIES + 1])
    for key, entry in entries:
        place = (*at, key)
        yield place, entry
        if isinstance(entry, (dict, list)) and (isinstance(key, int) or key in names):
            yield from _places(entry, names, place)


# Validates the entries of a document's lists, one after another, up to as many faults as are told.
#
# pydantic names all faults before anything else in the process goes on: a thousand items, each with every field of
# the others, take it a second. One entry after another holds nobody up.


_LIST_ENTRY: Final[TypeAdapter[Any]] = TypeAdapter(Annotated[PlanItem, Field(discriminator="type")])
_LISTS: Final[Mapping[str, TypeAdapter[Any]]] = {"items": _LIST_ENTRY, "rally_points": TypeAdapter(RallyPoint)}
_FENCES: Final[Mapping[str, TypeAdapter[Any]]] = {
    "polygons": TypeAdapter(FencePolygon),
    "circles": TypeAdapter(FenceCircle),
}


def with_entries(document: Mapping[str, Any]) -> dict[str, Any]:
    """The document with each valid entry as its model, so that nothing is validated twice.

    A list ends behind the entry that brings its faults to MAX_FINDINGS: it is no plan either.
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


# A document with nothing wrong is validated at its lists' own speed, some entries at a time: what holds the interpreter
# for longer holds up the setpoints of other threads.


AT_ONCE: Final = 100
"""Entries; with MAX_FIELDS it bounds what one call of pydantic has to say of a document that is no plan after all."""
_AT_ONCE: Final[Mapping[str, TypeAdapter[Any]]] = {
    "items": TypeAdapter(list[Annotated[PlanItem, Field(discriminator="type")]]),
    "rally_points": TypeAdapter(list[RallyPoint]),
}


def _plan_at_once(document: Any) -> Plan | None:
    """The plan of plain JSON data, None if it is none: why is said by those who look at it anew."""
    if not isinstance(document, dict):
        return None
    fence = document.get("geofence")
    lists = [document.get("items"), document.get("rally_points"), *(fence.values() if isinstance(fence, dict) else ())]
    if any(isinstance(entries, list) and len(entries) > MAX_ITEMS for entries in lists):
        return None
    try:
        made = {name: _some_at_once(document[name], kind) for name, kind in _AT_ONCE.items() if name in document}
        return Plan.model_validate({**document, **made})
    except ValueError:  # pydantic's ValidationError is one, and so is a text that cannot be encoded
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
    "literal_error": "plan.bad_value",
    "enum": "plan.bad_value",
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


class PlanInvalid(UnfitDocumentError):  # noqa: N818 - the public name
    """The document is not a plan. `findings` says what is wrong and where; all at once, at most 100."""

    code = "plan.invalid"


def parse_plan(raw: bytes | str | Mapping[str, Any]) -> Plan:
    """A Plan from JSON text, or from an object that a JSON reader made. Raises PlanInvalid and nothing else."""
    plan = _plan_at_once(read_at_once(raw))
    if plan is not None:
        return plan
    return _plan(read_json(raw) if isinstance(raw, bytes | str) else read_data(raw))


def parse_data(value: Any) -> Plan:
    """A Plan from what a JSON reader made of it: any value, text is no JSON text here. Raises PlanInvalid."""
    plan = None if isinstance(value, bytes | str) else _plan_at_once(read_at_once(value))
    return plan or _plan(read_data(value))


def _plan(tree: JsonTree) -> Plan:
    if not tree.findings:
        check_outline(tree, _field_names)
    if tree.findings:
        raise PlanInvalid(tree.findings)
    try:
        return Plan.model_validate(with_entries(tree.value))
    except ValidationError as error:
        raise PlanInvalid(_findings(error, tree.value)) from None


def plan_json_schema() -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of a plan."""
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
