"""Whether a flight did what was asked of it: pure, from the run as recorded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.domain.drop import Certainty, DropOutcome
from app.domain.reason import in_words
from app.domain.run import Run, RunState

_STRENGTH: Final = {Certainty.NONE: 0, Certainty.INFERRED: 1, Certainty.ACKNOWLEDGED: 2, Certainty.SENSED: 3}
STRICT: Final = Certainty.ACKNOWLEDGED
"""What --strict asks for: an answer of the vehicle. PX4's grippers have no sensor, so `sensed` has to be asked for."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """`reasons` is empty exactly if all was achieved."""

    reasons: tuple[str, ...]

    @property
    def achieved(self) -> bool:
        """Every drop was released with the certainty asked for, and the flight ended as its vehicle type ends."""
        return not self.reasons


def verdict(run: Run, *, least: Certainty) -> Verdict:
    """Judge a run that is over. `least` is the weakest certainty that counts."""
    reasons = []
    if run.state is not RunState.COMPLETED:
        why = f": {in_words(run.reason)}" if run.reason else ""
        reasons.append(f"the run is {run.state.value}{why}")
    for drop in run.last_drops:
        if drop.outcome is not DropOutcome.RELEASED:
            why = f": {in_words(drop.reason)}" if drop.reason else ""
            reasons.append(f"drop {drop.plan_item_id} is {drop.outcome.value}{why}")
        elif _STRENGTH[drop.certainty] < _STRENGTH[least]:
            unseen = ": no output was seen to move" if drop.rests_on_an_ack_alone else ""
            reasons.append(f"drop {drop.plan_item_id} is only {drop.certainty.value}, asked was {least.value}{unseen}")
    return Verdict(tuple(reasons))
