"""No release without an operator's consent where the plan asks for it, and none by it alone."""

from __future__ import annotations

from dataclasses import replace

from app.domain.drop.consent import ConsentState
from app.domain.drop.record import Certainty, DropOutcome, DropPhase
from app.domain.drop.supervised_inputs import ConsentGiven, DropTerms, ReleaseWithheld
from app.domain.drop.supervised_state import ANSWER_S, DropMachine
from app.domain.reasons import describe
from app.domain.vehicle.commands import MavResult
from app.domain.vehicle.state import FlightMode
from tests.support.supervised_flight import TERMS, Flight

ASKS = replace(TERMS, needs_consent=True, consent_timeout_s=8.0)


def asking(terms: DropTerms = ASKS) -> Flight:
    """A vehicle that holds at its drop, with the question asked."""
    flight = Flight(terms=terms)
    while flight.machine.consent.state is not ConsentState.ASKED:
        assert not flight.sends_s
        flight.tick()
    assert flight.machine.phase is DropPhase.ASKING
    return flight


def answer(flight: Flight, *, grant: bool, question: int | None = None) -> ConsentState | None:
    number = flight.machine.consent.question if question is None else question
    flight.feed(ConsentGiven(flight.now_s, number, grant))
    return flight.machine.consent.state


def test_it_is_asked_when_the_vehicle_stands_still_and_released_only_after_a_grant() -> None:
    flight = asking()
    assert not flight.moving
    flight.tick(5.0)
    assert not flight.sends_s
    assert answer(flight, grant=True) is ConsentState.GRANTED
    flight.tick()
    assert len(flight.sends_s) == 1
    flight.ack(MavResult.ACCEPTED)
    assert flight.finish is not None
    assert flight.finish.outcome is DropOutcome.RELEASED
    assert flight.machine.consent.state is ConsentState.GRANTED


def test_a_refusal_keeps_the_parcel_at_once_and_flies_on() -> None:
    flight = asking()
    answer(flight, grant=False)
    flight.tick()
    assert flight.finish is not None
    assert (flight.finish.outcome, flight.finish.certainty) == (DropOutcome.KEPT, Certainty.INFERRED)
    assert "refused" in describe(flight.finish.reason)
    assert flight.resumed


def test_no_answer_in_time_is_a_refusal_and_a_late_grant_does_not_count() -> None:
    flight = asking()
    flight.tick(8.5)
    assert flight.machine.consent.state is ConsentState.TIMED_OUT
    assert flight.finish is not None
    assert flight.finish.outcome is DropOutcome.KEPT
    assert answer(flight, grant=True) is ConsentState.TIMED_OUT
    flight.tick(30.0)
    assert not flight.sends_s


def test_a_grant_at_the_deadline_is_too_late_even_if_nobody_looked_since() -> None:
    flight = asking()
    flight.now_s = flight.machine.consent.deadline_s
    assert answer(flight, grant=True) is ConsentState.ASKED, "unchanged: the next look closes it"


def test_without_a_time_of_the_plan_the_hold_decides_and_what_is_left_still_covers_the_release() -> None:
    flight = asking(replace(TERMS, needs_consent=True))
    left_s = flight.machine.hold.left_s(flight.observation(), TERMS)
    waits_s = flight.machine.consent.deadline_s - flight.now_s
    assert waits_s <= left_s - TERMS.release_latency_s - ANSWER_S
    while flight.now_s + 0.2 < flight.machine.consent.deadline_s:
        flight.tick()
    assert answer(flight, grant=True) is ConsentState.GRANTED
    flight.tick()
    assert len(flight.sends_s) == 1
    assert not flight.sent_while_unsafe


def test_all_checks_are_made_again_after_the_grant() -> None:
    flight = asking()
    answer(flight, grant=True)
    flight.position_frozen_at_s = flight.now_s - 1.5
    flight.tick(3.0)
    assert not flight.sends_s, "the position is too old"
    flight.position_frozen_at_s = None
    flight.tick(0.4)
    assert len(flight.sends_s) == 1


def test_a_grant_that_is_not_used_within_the_hold_keeps_the_parcel() -> None:
    flight = asking()
    answer(flight, grant=True)
    flight.connected = False
    flight.tick(30.0)
    flight.connected = True
    flight.tick()
    assert not flight.sends_s
    assert flight.finish is not None
    assert flight.finish.outcome is DropOutcome.KEPT


def test_who_leaves_the_hold_and_comes_back_is_asked_for_anew() -> None:
    for granted in (False, True):
        flight = asking()
        if granted:
            answer(flight, grant=True)
        flight.mode = FlightMode.HOLD
        flight.tick()
        assert flight.machine.consent.state is ConsentState.WITHDRAWN
        flight.mode = FlightMode.MISSION
        flight.tick(6.0)
        assert not flight.sends_s, "the grant was for another hold"
        assert (flight.machine.consent.state, flight.machine.consent.question) == (ConsentState.ASKED, 2)
        assert answer(flight, grant=True, question=1) is ConsentState.ASKED, "an answer to the first question"
        assert answer(flight, grant=True, question=2) is ConsentState.GRANTED
        flight.tick()
        assert len(flight.sends_s) == 1


def test_a_mode_change_between_order_and_sending_takes_the_grant_away() -> None:
    flight = asking()
    answer(flight, grant=True)
    flight.tick()
    assert flight.machine.may_send(flight.observation())
    flight.mode = FlightMode.HOLD
    flight.tick()
    flight.mode = FlightMode.MISSION
    assert not flight.machine.may_send(flight.observation())
    flight.feed(ReleaseWithheld(flight.now_s, 1))
    flight.tick(4.0)
    assert len(flight.sends_s) == 1, "the second try waits for a second consent"


def test_the_question_times_out_over_a_lost_link_and_the_drop_ends_when_it_is_back() -> None:
    flight = asking()
    flight.connected = False
    flight.tick(9.0)
    assert flight.machine.consent.state is ConsentState.TIMED_OUT
    assert flight.finish is None, "what the plan says of it could not be sent"
    flight.connected = True
    flight.tick()
    assert flight.finish is not None
    assert "in time" in describe(flight.finish.reason)
    assert not flight.sends_s


def test_it_is_not_asked_when_too_little_of_the_hold_is_left() -> None:
    flight = Flight(terms=replace(ASKS, hold_s=7.0))
    flight.tick(25.0)
    assert flight.machine.consent.question == 0
    assert flight.finish is not None
    assert "too little" in describe(flight.finish.reason)


def test_after_our_restart_in_the_question_nothing_is_released_and_nothing_is_asked_in_that_hold() -> None:
    flight = asking()
    flight.machine = DropMachine.recovered(ASKS, 0, questions=1)
    flight.tick(30.0)
    assert not flight.sends_s
    assert flight.finish is not None
    assert flight.finish.outcome is DropOutcome.KEPT
    assert flight.machine.consent.question == 1


def test_the_run_that_ends_withdraws_the_question() -> None:
    flight = asking()
    flight.end()
    assert flight.machine.consent.state is ConsentState.WITHDRAWN
