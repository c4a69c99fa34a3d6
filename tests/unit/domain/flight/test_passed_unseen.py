"""A supervised drop that the mission passes while the link is lost."""

from __future__ import annotations

from dataclasses import dataclass, replace

import pytest

from app.domain.drop.record import Certainty, DropOutcome, DropPhase
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunState
from app.domain.vehicle.state import VehicleState
from tests.support.flown_flights import DROP, Flown


@dataclass
class OutOfRange(Flown):
    """`is_away`: nothing of it is heard."""

    is_away: bool = False

    @property
    def state(self) -> VehicleState:
        return replace(super().state, connected=not self.is_away)

    def fly(self, seconds: float) -> None:
        for _ in range(round(seconds * 10)):
            self.tick()


@pytest.mark.parametrize("begins_s", [1.0, 3.5])
def test_it_is_closed_as_not_seen_once_the_vehicle_is_heard_on_its_return(begins_s: float) -> None:
    """It was told as kept because the mission was complete, at the end of the run."""
    flown = OutOfRange()
    while flown.seq < DROP.hold_seqs[0]:
        flown.tick()
    flown.fly(begins_s)
    flown.is_away = True
    while flown.seq == DROP.hold_seqs[0]:
        flown.tick()
    flown.is_away = False
    flown.fly(3.8)
    drop = flown.run.drops[0]
    assert not flown.run.is_over
    assert (drop.phase, drop.outcome, drop.certainty) == (DropPhase.DONE, DropOutcome.KEPT, Certainty.INFERRED)
    assert drop.reason == Reason.of(ReasonCode.DROP_HOLD_NOT_SEEN)
    assert flown.to_the_end().state is RunState.COMPLETED
    assert flown.commands == []
