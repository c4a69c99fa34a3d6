"""`waydrop fly` ends with 0 only if every drop was released, surely enough, and the run completed."""

from __future__ import annotations

import pytest

from app.cli.run_view import STRICT, assess
from app.domain.drop.record import Certainty, DropOutcome, DropRecord, OutputEvidence
from app.domain.run.run import RunState
from tests.support.assessed_runs import ACKNOWLEDGED, INFERRED, a_drop, a_run
from tests.support.reasons import some

SENSED = a_drop(DropOutcome.RELEASED, Certainty.SENSED)


def test_all_released_and_completed_is_achieved() -> None:
    assert assess(a_run(RunState.COMPLETED, INFERRED, SENSED), least=Certainty.INFERRED).achieved


def test_a_run_without_drops_is_achieved_when_it_completed() -> None:
    assert assess(a_run(), least=Certainty.SENSED).achieved


@pytest.mark.parametrize("state", [state for state in RunState if state is not RunState.COMPLETED])
def test_no_other_end_is_achieved(state: RunState) -> None:
    assessment = assess(a_run(state, SENSED, reason=some("low battery")), least=Certainty.INFERRED)
    assert assessment.reasons == (f"the run is {state.value}: low battery",)


@pytest.mark.parametrize("outcome", [DropOutcome.KEPT, DropOutcome.UNKNOWN, DropOutcome.PENDING])
def test_a_drop_not_released_is_named_with_its_reason(outcome: DropOutcome) -> None:
    run = a_run(RunState.COMPLETED, SENSED, a_drop(outcome, reason=some("stuck")))
    assessment = assess(run, least=Certainty.INFERRED)
    assert assessment.reasons == (f"drop clinic is {outcome.value}: stuck",)


def test_sensed_refuses_an_ack_alone_and_says_that_no_output_moved() -> None:
    alone = ACKNOWLEDGED.model_copy(update={"output_evidence": OutputEvidence.NOT_ASSIGNED})
    assert assess(a_run(RunState.COMPLETED, alone), least=Certainty.ACKNOWLEDGED).achieved
    assessment = assess(a_run(RunState.COMPLETED, alone), least=Certainty.SENSED)
    assert assessment.reasons == (
        "drop clinic is only acknowledged, but sensed was required: no movement of an output was observed",
    )


@pytest.mark.parametrize(
    ("least", "good", "weak"),
    [
        (Certainty.INFERRED, [INFERRED, ACKNOWLEDGED, SENSED], []),
        (STRICT, [ACKNOWLEDGED, SENSED], [INFERRED]),
        (Certainty.SENSED, [SENSED], [INFERRED, ACKNOWLEDGED]),
    ],
)
def test_a_weaker_certainty_than_asked_is_not_achieved(
    least: Certainty, good: list[DropRecord], weak: list[DropRecord]
) -> None:
    assert all(assess(a_run(RunState.COMPLETED, drop), least=least).achieved for drop in good)
    for drop in weak:
        assessment = assess(a_run(RunState.COMPLETED, drop), least=least)
        assert assessment.reasons == (f"drop clinic is only {drop.certainty.value}, but {least.value} was required",)
