"""A flight that the autopilot has terminated: its mode says nothing of that (PX4 v1.19, flown)."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.drop.record import DropOutcome
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunAction, RunState
from app.domain.vehicle.state import FlightMode, LandedState, VehicleState
from tests.support.flown_flights import DROP, Flown
from tests.support.told_flight import Told

TERMINATED = Reason.of(ReasonCode.TERMINATED)
STOPPED = {"in_failsafe": True, "is_terminated": True}


@pytest.mark.parametrize("disarmed", [{"armed": False}, {"armed": False, "mode": FlightMode.HOLD}])
def test_the_run_says_so_and_fails_for_it(disarmed: dict[str, object]) -> None:
    told = Told()
    told.see(3.0)
    told.see(2.0, **STOPPED)
    assert (told.run.state, told.run.reason) == (RunState.RETURNING, TERMINATED)
    told.see(2.0, landed=LandedState.ON_GROUND)
    assert told.run.reason == TERMINATED, "armed, it still lies where it fell"
    told.see(5.0, **disarmed)
    assert (told.run.state, told.run.reason) == (RunState.FAILED, TERMINATED)
    drop = told.run.drops[0]
    assert (drop.outcome, drop.reason) == (DropOutcome.KEPT, TERMINATED)


def test_it_may_be_told_after_the_ground() -> None:
    told = Told()
    told.see(3.0)
    told.see(0.5, landed=LandedState.ON_GROUND)
    told.see(5.0, armed=False, **STOPPED)
    assert (told.run.state, told.run.reason) == (RunState.FAILED, TERMINATED)


def test_a_crew_that_kills_it_after_a_return_has_not_terminated_the_flight() -> None:
    told = Told()
    told.see(3.0)
    told.command(RunAction.RETURN)
    told.see(3.0, mode=FlightMode.RETURN)
    told.see(1.0, landed=LandedState.ON_GROUND)
    told.see(5.0, armed=False, **STOPPED)
    assert told.run.state is RunState.ABORTED


class StoppedAtDrop(Flown):
    """Falls as its hold has begun, and lies near the place."""

    @property
    def state(self) -> VehicleState:
        before = super().state
        return replace(before, **STOPPED) if self.seq == DROP.hold_seqs[0] else before  # type: ignore[arg-type]

    def go_on(self, seq: int) -> None:
        if self.seq != DROP.hold_seqs[0]:
            super().go_on(seq)


def test_nothing_is_released_nor_commanded_at_a_drop() -> None:
    flown = StoppedAtDrop()
    while flown.at_item_s < DROP.hold_s + 20.0:
        flown.tick()
    assert flown.commands == []
    assert flown.run.reason == TERMINATED
