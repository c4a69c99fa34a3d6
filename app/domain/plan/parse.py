"""JSON to Plan. Whatever comes in, the answer is a Plan or PlanInvalid with findings."""

from __future__ import annotations

import json
from collections.abc import Mapping
from difflib import get_close_matches
from functools import cache
from typing import Any

from pydantic import TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from app.domain.finding import Finding, Severity, UnfitDocumentError, json_pointer
from app.domain.plan.document import Plan
from app.domain.plan.json_tree import JsonTree, read_json
from app.domain.plan.size_limits import MAX_FINDINGS, MAX_ITEMS

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


class PlanInvalid(UnfitDocumentError):  # noqa: N818 - the public name
    """The document is not a plan. `findings` says what is wrong and where; all at once, at most 100."""

    code = "plan.invalid"


def parse_plan(raw: bytes | str | Mapping[str, Any]) -> Plan:
    """A Plan from JSON text or from data that json.loads made. Raises PlanInvalid and nothing else."""
    tree = read_json(raw)
    if not tree.findings:
        _check_outline(tree)
    if tree.findings:
        raise PlanInvalid(tree.findings)
    try:
        # Strict types are those of JSON (an array is a tuple), so the checked tree goes through JSON once more.
        return Plan.model_validate_json(json.dumps(tree.value))
    except ValidationError as error:
        raise PlanInvalid(_findings(error, tree.value)) from None


def plan_json_schema() -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of a plan."""
    schema = TypeAdapter(Plan).json_schema(mode="validation")
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "Waydrop delivery plan", **schema}


def _check_outline(tree: JsonTree) -> None:
    if not isinstance(tree.value, dict):
        tree.refuse("plan.not_an_object", "", "a plan is a JSON object")
        return
    items = tree.value.get("items")
    if isinstance(items, list) and len(items) > MAX_ITEMS:
        tree.refuse("plan.too_many_items", "/items", f"{len(items)} items, at most {MAX_ITEMS} are taken")


def _findings(error: ValidationError, value: Any) -> list[Finding]:
    errors = error.errors(include_url=False, include_input=False)
    places = {details["loc"] for details in errors}
    return [
        Finding(
            code=_CODES.get(details["type"], _OTHER_CODE),
            severity=Severity.ERROR,
            pointer=details.get("ctx", {}).get("pointer") or _pointer(details["loc"]),
            message=_message(details),
            item_id=_item_id(details["loc"], value),
            hint=_hint(details),
        )
        for details in errors
        if not (details["type"] == "too_short" and _has_inner(details["loc"], places))
    ][:MAX_FINDINGS]


def _message(details: ErrorDetails) -> str:
    """pydantic's sentence, or ours where a person who writes JSON would not understand it."""
    last = details["loc"][-1] if details["loc"] else ""
    match details["type"]:
        case "extra_forbidden":
            return f"there is no field {str(last)!r}"
        case "missing":
            return f"the field {str(last)!r} is missing"
        case "union_tag_invalid":
            return f"there is no item type {details['ctx']['tag']!r}"
        case _:
            return details["msg"]


def _hint(details: ErrorDetails) -> str:
    match details["type"]:
        case "extra_forbidden":
            near = get_close_matches(str(details["loc"][-1]), _field_names(), n=1)
        case "union_tag_invalid":
            near = get_close_matches(str(details["ctx"]["tag"]), _item_types(), n=1)
            return f"did you mean {near[0]!r}?" if near else f"known: {', '.join(_item_types())}"
        case _:
            return ""
    return f"did you mean {near[0]!r}?" if near else "take it away, or see `waydrop schema`"


@cache
def _field_names() -> tuple[str, ...]:
    schema = plan_json_schema()
    parts = (schema, *schema["$defs"].values())
    return tuple(sorted({name for part in parts for name in part.get("properties", {})}))


@cache
def _item_types() -> tuple[str, ...]:
    return tuple(plan_json_schema()["properties"]["items"]["items"]["discriminator"]["mapping"])


def _has_inner(location: tuple[int | str, ...], places: set[tuple[int | str, ...]]) -> bool:
    """pydantic also calls a list too short whose elements are all wrong."""
    return any(len(place) > len(location) and place[: len(location)] == location for place in places)


def _pointer(location: tuple[int | str, ...]) -> str:
    """pydantic's location without the item type that it writes behind the index of a union."""
    if len(location) > 2 and location[0] == "items" and isinstance(location[1], int):
        location = (*location[:2], *location[3:])
    return json_pointer(*location)


def _item_id(location: tuple[int | str, ...], value: Any) -> str | None:
    if len(location) < 2 or location[0] != "items" or not isinstance(location[1], int):
        return None
    item = value["items"][location[1]]
    name = item.get("id") if isinstance(item, dict) else None
    return name if isinstance(name, str) else None
