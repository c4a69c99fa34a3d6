"""Reasons: a code with parameters, which only an edge turns into words. See docs/reference/reasons.md."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.domain.reasons import Reason, ReasonCode, describe
from tests.support.golden_mission import REASON_WORDS, REASONS_PAGE
from tests.support.paths import ROOT
from tools.reference import reason_words, reasons_page

APP = ROOT / "app"
ALWAYS_MORE = {"error", "code"}
"""Parameters beside the words: the code of an error, or of a refusal, that stands behind."""


def calls() -> Iterator[tuple[Path, ast.Call]]:
    """Each place in app/ where a reason is made with `Reason.of`."""
    for path in sorted(APP.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "Reason.of":
                yield path, node


def codes_in(node: ast.expr) -> list[ReasonCode]:
    """The codes that are named in an expression; none if it is a variable."""
    found = [n for n in ast.walk(node) if isinstance(n, ast.Attribute) and isinstance(n.value, ast.Name)]
    return [ReasonCode[n.attr] for n in found if isinstance(n.value, ast.Name) and n.value.id == "ReasonCode"]


def test_each_reason_is_made_with_what_its_words_need() -> None:
    wrong = []
    for path, call in calls():
        if any(keyword.arg is None for keyword in call.keywords):
            continue  # **params: see the tests of that module
        given = {keyword.arg for keyword in call.keywords} - ALWAYS_MORE | ({"cause"} if len(call.args) > 1 else set())
        for code in codes_in(call.args[0]):
            optional = {"cause"} if code is ReasonCode.JOB_NOT_READY else set()
            if given - optional != {*code.parameters}:
                wrong.append(f"{path.name}:{call.lineno} {code}: {sorted(given)} for {sorted(code.parameters)}")
    assert not wrong


def test_each_code_is_used() -> None:
    text = "".join(path.read_text(encoding="utf-8") for path in APP.rglob("*.py"))
    unused = [code.name for code in ReasonCode if f"ReasonCode.{code.name}" not in text]
    assert not unused


@pytest.mark.parametrize("code", ReasonCode)
def test_a_code_is_stable_and_its_words_are_a_sentence_without_capital_and_stop(code: ReasonCode) -> None:
    assert re.fullmatch(r"[a-z_]+(\.[a-z_]+)?", code.value)
    assert code.words == code.words.strip(" .")
    filled = describe(Reason.of(code, Reason.of(ReasonCode.ON_GROUND), **dict.fromkeys(code.parameters - {"cause"}, 1)))
    assert "{" not in filled
    assert "?" not in filled


def test_it_is_stored_and_read_again_as_it_was() -> None:
    reason = Reason.of(ReasonCode.DROP_ACKNOWLEDGED_THEN, Reason.of(ReasonCode.NOT_HEARD, silent_s=60.25))
    assert Reason.model_validate_json(reason.model_dump_json()) == reason
    assert describe(reason) == "acknowledged; then no message from the vehicle for 60 s"


def test_an_error_is_told_with_its_code_and_its_hint() -> None:
    reason = Reason.of_error("vehicle.refused", "arming denied", "charge it")
    assert (reason.params["error"], describe(reason)) == ("vehicle.refused", "arming denied; charge it")
    assert describe(Reason.of_error("vehicle.refused", "arming denied")) == "arming denied"


def test_no_reason_has_no_words_and_a_missing_parameter_leaves_a_gap() -> None:
    assert describe(None) == ""
    assert describe(Reason.of(ReasonCode.NOT_HEARD)) == "no message from the vehicle for ? s"


def test_braces_in_what_a_vehicle_said_are_its_own() -> None:
    assert describe(Reason.of_error("link", "{cause} {0} {detail}")) == "{cause} {0} {detail}"


def test_the_page_and_the_browsers_words_are_up_to_date() -> None:
    promise = "docs/reference/reasons.md is generated: python -m tests.support.regenerate_golden_missions"
    assert REASONS_PAGE.read_text(encoding="utf-8") == reasons_page(), promise
    assert REASON_WORDS.read_text(encoding="utf-8") == reason_words(), promise
