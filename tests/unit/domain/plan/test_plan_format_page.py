"""docs/reference/plan-format.md says all that the plan format has."""

from __future__ import annotations

import re
from typing import Any

from app.domain.plan import parse_plan, plan_json_schema
from app.domain.plan.parse import _CODES
from app.domain.rules import check_plan
from tests.support.paths import ROOT

PAGE = (ROOT / "docs" / "reference" / "plan-format.md").read_text(encoding="utf-8")
CODE = re.compile(r'"(plan\.[a-z_]+)"')


def test_the_example_is_a_plan_without_findings() -> None:
    example = re.search(r"```json\n(.*?)```", PAGE, re.DOTALL)
    assert example is not None
    assert check_plan(parse_plan(example.group(1)), None) == ()


def test_every_field_is_described() -> None:
    assert {name for name in _field_names(plan_json_schema()) if f"`{name}`" not in PAGE} == set()


def test_every_word_that_a_field_takes_is_described() -> None:
    assert {word for word in _words(plan_json_schema()) if f"`{word}`" not in PAGE} == set()


def test_every_code_is_described() -> None:
    reader = (ROOT / "app" / "domain" / "plan" / "json_tree.py").read_text(encoding="utf-8")
    parser = (ROOT / "app" / "domain" / "plan" / "parse.py").read_text(encoding="utf-8")
    codes = {*_CODES.values(), *CODE.findall(reader), *CODE.findall(parser)} - {"plan.invalid"}
    assert {code for code in codes if f"`{code}`" not in PAGE} == set()


def _field_names(schema: dict[str, Any]) -> set[str]:
    parts = [schema, *schema["$defs"].values()]
    return {name for part in parts for name in part.get("properties", {})}


def _words(value: Any) -> set[str]:
    if isinstance(value, list):
        return {word for inner in value for word in _words(inner)}
    if not isinstance(value, dict):
        return set()
    own = [*value.get("enum", []), value.get("const")]
    words = {word for word in own if isinstance(word, str)}
    return words | {word for inner in value.values() for word in _words(inner)}
