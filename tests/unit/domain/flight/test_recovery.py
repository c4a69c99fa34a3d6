"""A flight that is killed at any look and taken up again ends as one that never died, or safely. See decision 27."""

from __future__ import annotations

from collections import Counter
from typing import Final

import pytest

from app.domain.drop.record import Certainty, DropOutcome
from app.domain.run.run import Run, RunState
from tests.support.flown_flights import Flown, prefixes

SAFE_DIFFERENCES: Final = {
    (RunState.COMPLETED, DropOutcome.RELEASED, Certainty.INFERRED): "the ack was lost: the output alone tells",
    (RunState.ABORTED, DropOutcome.KEPT, Certainty.INFERRED): "the hold's end is not known: the plan's contingency",
    (
        RunState.COMPLETED,
        DropOutcome.KEPT,
        Certainty.INFERRED,
    ): "the hold was over: the mission went on",
}
"""What may be otherwise at the end, and why. Decision 27 says why each of them is safe."""


def outcome(run: Run) -> tuple[RunState, DropOutcome, Certainty]:
    """What a dispatcher is told at the end."""
    return run.state, run.drops[0].outcome, run.drops[0].certainty


def test_it_flies_to_its_end() -> None:
    run = Flown().to_the_end()
    assert outcome(run) == (RunState.COMPLETED, DropOutcome.RELEASED, Certainty.ACKNOWLEDGED)
    assert run.flown_item_ids == ("takeoff", "corner", "clinic", "drop", "home")


@pytest.mark.parametrize("down_s", [0.0, 3.0, 40.0])
def test_killed_at_any_look_and_taken_up_it_ends_as_if_it_had_never_died_or_safely(down_s: float) -> None:
    lived, found = outcome(Flown().to_the_end()), Counter[str]()
    for flown in prefixes(Flown()):
        died = flown.restarted(down_s)
        end = outcome(died.to_the_end())
        found["the same" if end == lived else SAFE_DIFFERENCES.get(end, f"{end}, killed at {flown.now_s:.1f}")] += 1
        has_left = died.released_s is not None
        assert has_left is (died.run.drops[0].outcome is DropOutcome.RELEASED), "a parcel is where the run says"
    assert {*found} <= {"the same", *SAFE_DIFFERENCES.values()}
    if down_s == 0.0:
        assert found["the same"] > 0.9 * found.total(), found
