"""The laws of the reducer, whatever a vehicle, a link, an operator and a client do, in whatever order."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

from hypothesis import given, settings

from app.domain.drop.record import DropOutcome, DropPhase
from app.domain.flight.flight import Flight
from app.domain.flight.inputs import (
    FlightEffect,
    FlightInput,
    Observed,
    RecordEvent,
    Recovered,
    ReleaseAcknowledged,
    ReleaseNotSent,
    ReleaseUnanswered,
)
from app.domain.flight.snapshot import ReleaseCommand
from app.domain.flight.step import HANDLED, step
from app.domain.mission import MavCmd
from app.domain.run.run import TERMINAL, Run, RunState
from app.domain.vehicle.commands import CommandAck, MavResult
from tests.support.flown_flights import DROP, Flown, a_flight, a_run
from tests.support.stepped_flight import inputs, inputs_after


def folded(given: list[FlightInput]) -> list[tuple[Flight, tuple[FlightEffect, ...]]]:
    """The flight after each input, with its effects."""
    flight, after = a_flight(a_run()), []
    for one in given:
        flight, effects = step(flight, one)
        after.append((flight, effects))
    return after


def test_each_kind_of_input_has_its_step() -> None:
    assert {*get_args(FlightInput)} == HANDLED


def releasing() -> Flown:
    """A flight that has just ordered its first release."""
    flown = Flown()
    while flown.attempt == 0:
        flown.tick()
    return flown


RELEASING = releasing()


@given(inputs_after(RELEASING.observed))
@settings(max_examples=300, deadline=None)
def test_a_release_is_never_ordered_twice_nor_after_an_accepted_one(given: list[FlightInput]) -> None:
    flight, ordered, pending, accepted = RELEASING.flight, [RELEASING.attempt], RELEASING.attempt, False
    for one in given:
        flight, effects = step(flight, one)
        sent = [effect.attempt for effect in effects if isinstance(effect, ReleaseCommand)]
        assert not (accepted and sent), "the gripper was open already"
        ordered += sent
        if isinstance(one, ReleaseAcknowledged | ReleaseUnanswered | ReleaseNotSent) and one.attempt == pending:
            is_ack = isinstance(one, ReleaseAcknowledged)
            accepted = is_ack and one.ack.result is MavResult.ACCEPTED
            pending = pending if is_ack and not one.ack.is_final else 0  # whoever sends it tells one end of it
        pending = sent[-1] if sent else pending
    assert ordered == sorted(set(ordered)), "each attempt once, one after another"


@given(inputs())
@settings(max_examples=300, deadline=None)
def test_a_drop_that_is_over_stays_as_it_is(given: list[FlightInput]) -> None:
    over = None
    for flight, _ in folded(given):
        drop = flight.run.drops[0]
        if over is not None:
            assert (drop.outcome, drop.certainty, drop.reason) == over
        if drop.phase is DropPhase.DONE:
            over = (drop.outcome, drop.certainty, drop.reason)
            assert drop.outcome is not DropOutcome.PENDING


@given(inputs())
@settings(max_examples=300, deadline=None)
def test_a_run_that_is_over_does_nothing_more_and_none_of_its_drops_is_open(given: list[FlightInput]) -> None:
    over: Run | None = None
    for flight, effects in folded(given):
        if over is not None:
            assert (flight.run, effects) == (over, ())
        if flight.run.state in TERMINAL:
            over = flight.run
            assert all(drop.phase is DropPhase.DONE for drop in over.drops)


@given(inputs())
@settings(max_examples=100, deadline=None)
def test_the_same_inputs_give_the_same_flight(given: list[FlightInput]) -> None:
    assert folded(given) == folded(given)


@given(inputs())
@settings(max_examples=100, deadline=None)
def test_what_was_flown_only_grows_and_each_change_of_the_run_is_recorded(given: list[FlightInput]) -> None:
    before = a_flight(a_run())
    for flight, effects in folded(given):
        assert flight.run.flown_item_ids[: len(before.run.flown_item_ids)] == before.run.flown_item_ids
        told = any(isinstance(effect, RecordEvent) for effect in effects)
        assert told or flight.run == before.run
        before = flight


def test_an_answer_for_a_plan_that_was_changed_since_reaches_no_drop() -> None:
    flown = releasing()
    late = ReleaseAcknowledged(
        flown.observed, 1, DROP.plan_item_id, 1, CommandAck(MavCmd.DO_GRIPPER, MavResult.ACCEPTED)
    )
    after, effects = step(flown.flight, late)
    assert (after.run, effects) == (flown.run, ())


def test_a_flight_that_is_taken_up_after_its_landing_ends() -> None:
    flown = Flown()
    while not flown.landed:
        flown.tick()
    again = a_flight(flown.run.model_copy(update={"state": RunState.FLYING}), flown.now_s)
    again, _ = step(
        again,
        Recovered(flown.observed, in_flight=True, flown=flown.run.flown_item_ids, current=flown.state.mission_seq),
    )
    for seconds in range(8):
        again, _ = step(again, Observed(replace(flown.observed, now_s=flown.now_s + seconds)))
    assert again.run.state is RunState.COMPLETED
