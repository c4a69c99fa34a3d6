"""JSON to Plan. Whatever comes in, the answer is a Plan or PlanInvalid with findings."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from typing import Any, Final

from pydantic import TypeAdapter, ValidationError

from app.domain.finding import Finding, UnfitDocumentError
from app.domain.plan.document import Plan
from app.domain.plan.first_faulty import with_entries
from app.domain.plan.json_tree import JsonTree, read_data, read_json
from app.domain.plan.outline import check_outline
from app.domain.validation import findings_of

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
    return _plan(read_json(raw) if isinstance(raw, bytes | str) else read_data(raw))


def parse_data(value: Any) -> Plan:
    """A Plan from what a JSON reader made of it: any value, text is no JSON text here. Raises PlanInvalid."""
    return _plan(read_data(value))


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
