"""The line that a person reads for an event of a run."""

from __future__ import annotations

import pytest

from app.cli.run_lines import run_line
from app.domain.events import EventKind
from tests.unit.cli.scripted_service import event


@pytest.mark.parametrize(
    ("problem", "line"),
    [
        (None, "simulated fault wind = [3.0, 0.0]"),
        ("vehicle 1 has no winch", "simulated fault wind = [3.0, 0.0], not set: vehicle 1 has no winch"),
    ],
)
def test_a_simulated_fault_is_told_with_its_value_and_why_it_was_not_set(problem: str | None, line: str) -> None:
    told = run_line(event(1, EventKind.SIMULATOR_FAULT, fault="wind", value=[3.0, 0.0], by="desk", problem=problem))
    assert told is not None
    assert told.plain.endswith(f" {line}")


def test_a_question_says_how_to_answer_it_and_its_end_who_did() -> None:
    asked = run_line(event(1, EventKind.DROP_CONSENT_ASKED, plan_item_id="drop", question=1, deadline_at=1010.0))
    assert asked is not None
    assert "drop asks for consent until" in asked.plain
    assert "waydrop runs consent r1 drop --question 1 --grant" in asked.plain
    closed = {"plan_item_id": "drop", "question": 1, "state": "timed_out", "by": None, "reason": ""}
    told = run_line(event(2, EventKind.DROP_CONSENT_CLOSED, **closed))
    assert told is not None
    assert told.plain.endswith("consent to drop: timed out")
    granted = run_line(event(3, EventKind.DROP_CONSENT_CLOSED, **closed | {"state": "refused", "by": "anna"}))
    assert granted is not None
    assert granted.plain.endswith("consent to drop: refused by anna")


def test_an_ack_alone_is_told_as_a_warning_and_so_is_a_gripper_without_an_output() -> None:
    drop = {"plan_item_id": "drop", "supervised": True, "outcome": "released", "certainty": "acknowledged"}
    styles = {}
    for evidence in ("moved", "not_assigned"):
        told = run_line(event(1, EventKind.RUN_DROP, **drop, output_evidence=evidence))
        assert told is not None
        styles[evidence] = {str(span.style) for span in told.spans}
    assert "bold green" in styles["moved"]
    assert "bold green" not in styles["not_assigned"]
    waiting = run_line(
        event(
            1,
            EventKind.RUN_DROP,
            plan_item_id="drop",
            supervised=True,
            outcome="pending",
            phase="waiting",
            output_evidence="not_assigned",
        )
    )
    assert waiting is not None
    assert "no output is assigned to the gripper" in waiting.plain
