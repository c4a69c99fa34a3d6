"""The line that a person reads for an event of a run."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from app.cli.run_view import TerminalView, run_line
from app.domain.drop.consent import ConsentState
from app.domain.drop.record import Certainty, DropOutcome, DropRecord, OutputEvidence
from app.domain.events.run import DropConsentAsked, DropConsentClosed, RunDrop, RunItem
from app.domain.events.service import SimulatorFault
from tests.support.scripted_service import event


@pytest.mark.parametrize(
    ("problem", "line"),
    [
        (None, "simulated fault wind = [3.0, 0.0]"),
        ("vehicle 1 has no winch", "simulated fault wind = [3.0, 0.0], not set: vehicle 1 has no winch"),
    ],
)
def test_a_simulated_fault_is_told_with_its_value_and_why_it_was_not_set(problem: str | None, line: str) -> None:
    told = run_line(event(1, SimulatorFault(fault="wind", value=[3.0, 0.0], actor="desk", problem=problem)))
    assert told is not None
    assert told.plain.endswith(f" {line}")


def test_a_question_says_how_to_answer_it_and_its_end_who_did() -> None:
    asked = run_line(event(1, DropConsentAsked(plan_item_id="drop", question=1, deadline_at=1010.0, checked=None)))
    assert asked is not None
    assert "drop requests consent until" in asked.plain
    assert "waydrop runs consent r1 drop --question 1 --grant" in asked.plain
    closed = DropConsentClosed(plan_item_id="drop", question=1, state=ConsentState.TIMED_OUT, actor=None)
    told = run_line(event(2, closed))
    assert told is not None
    assert told.plain.endswith("consent to drop: timed out")
    granted = run_line(event(3, closed.model_copy(update={"state": ConsentState.REFUSED, "actor": "anna"})))
    assert granted is not None
    assert granted.plain.endswith("consent to drop: refused by anna")


def test_an_ack_alone_is_told_as_a_warning_and_so_is_a_gripper_without_an_output() -> None:
    released = DropRecord(
        plan_item_id="drop", supervised=True, outcome=DropOutcome.RELEASED, certainty=Certainty.ACKNOWLEDGED
    )
    styles = {}
    for evidence in ("moved", "not_assigned"):
        drop = released.model_copy(update={"output_evidence": OutputEvidence(evidence)})
        told = run_line(event(1, RunDrop(drop)))
        assert told is not None
        styles[evidence] = {str(span.style) for span in told.spans}
    assert "bold green" in styles["moved"]
    assert "bold green" not in styles["not_assigned"]
    pending = DropRecord(plan_item_id="drop", supervised=True, output_evidence=OutputEvidence.NOT_ASSIGNED)
    waiting = run_line(event(1, RunDrop(pending)))
    assert waiting is not None
    assert "no output is assigned to the gripper" in waiting.plain


def test_an_item_is_reached_after_the_vehicle_flew_to_it_and_once() -> None:
    """As flown: the speed change of `door` is reached while the vehicle is at `east`, each visit of a loop counts."""
    written = io.StringIO()
    view = TerminalView(Console(file=written, width=100))
    told = (
        *(("current", 2, "east"), ("reached", 2, "east"), ("reached", 3, "door"), ("current", 4, "door")),
        *(("reached", 4, "door"), ("reached", 4, "door"), ("current", 2, "east"), ("reached", 2, "east")),
    )
    for number, (phase, seq, item_id) in enumerate(told, start=1):
        view.event(event(number, RunItem.model_validate({"phase": phase, "seq": seq, "item_id": item_id})))
    lines = [line.split(" ", 1)[1] for line in written.getvalue().splitlines()]
    assert lines == ["flies to east", "reached east", "flies to door", "reached door", "flies to east", "reached east"]
