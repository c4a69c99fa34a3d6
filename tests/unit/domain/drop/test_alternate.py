"""From which failures a supervised drop leads on to its alternate."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.drop.record import DropOutcome
from app.domain.drop.supervised_inputs import ConsentGiven
from app.domain.drop.supervised_state import DropMachine
from app.domain.vehicle.commands import MavResult
from app.domain.vehicle.state import FlightMode
from tests.support.supervised_flight import TERMS, Flight

WITH_ALTERNATE = replace(TERMS, resume_seq=5, alternate_seq=4, leave_s=5.0)
ASKING = replace(WITH_ALTERNATE, needs_consent=True)


def test_a_refused_consent_leads_on() -> None:
    flight = Flight(terms=ASKING)
    flight.tick(6.0)
    assert flight.machine.consent.question == 1
    flight.feed(ConsentGiven(flight.now_s, 1, grant=False))
    flight.tick()
    assert flight.diverted
    assert flight.seq == 4


def test_an_unanswered_question_leads_on_although_it_used_all_of_the_hold() -> None:
    flight = Flight(terms=ASKING)
    flight.tick(60.0)
    assert flight.diverted
    assert flight.finish is not None
    assert flight.finish.outcome is DropOutcome.KEPT


@pytest.mark.parametrize("result", [MavResult.DENIED, MavResult.UNSUPPORTED, MavResult.FAILED])
def test_a_release_that_the_vehicle_refused_leads_on(result: MavResult) -> None:
    flight = Flight(terms=WITH_ALTERNATE)
    flight.until_sent()
    flight.ack(result)
    assert flight.diverted


def test_a_hold_in_which_the_checks_never_allowed_a_release_leads_on_before_it_ends() -> None:
    flight = Flight(terms=replace(WITH_ALTERNATE, max_offset_m=0.1))
    flight.tick(20.0 + WITH_ALTERNATE.hold_s)
    assert flight.diverted
    assert not flight.sends_s


def test_without_an_alternate_such_a_hold_ends_by_itself() -> None:
    flight = Flight(terms=replace(TERMS, max_offset_m=0.1))
    flight.tick(20.0 + TERMS.hold_s + 5.0)
    assert not flight.diverted
    assert flight.seq == TERMS.resume_seq


def test_a_release_without_an_answer_never_leads_on_even_if_the_output_is_still_at_grab() -> None:
    flight = Flight(terms=WITH_ALTERNATE, knows_output=True)
    for attempt in range(1, TERMS.max_attempts + 1):
        flight.until_sent(attempt)
        flight.time_out()
    flight.tick(1.0)
    assert flight.finish is not None
    assert flight.finish.outcome is DropOutcome.KEPT
    assert not flight.diverted, "that command may still arrive"


def test_an_accepted_release_never_leads_on() -> None:
    flight = Flight(terms=WITH_ALTERNATE)
    flight.until_sent()
    flight.ack(MavResult.ACCEPTED)
    flight.tick(60.0)
    assert not flight.diverted
    assert flight.resumed


def test_who_took_the_vehicle_out_of_mission_mode_keeps_it() -> None:
    flight = Flight(terms=ASKING)
    flight.tick(6.0)
    flight.mode = FlightMode.HOLD
    flight.feed(ConsentGiven(flight.now_s, flight.machine.consent.question, grant=False))
    flight.tick(5.0)
    assert not flight.diverted


def test_after_a_restart_that_does_not_know_the_hold_nothing_leads_on() -> None:
    flight = Flight(terms=WITH_ALTERNATE, offset_m=0.2)
    flight.machine = DropMachine.recovered(WITH_ALTERNATE, 0)
    flight.tick(2.0)
    assert flight.finish is not None
    assert not flight.diverted


def test_with_the_link_cut_nothing_leads_on() -> None:
    flight = Flight(terms=ASKING)
    flight.tick(6.0)
    flight.connected = False
    flight.feed(ConsentGiven(flight.now_s, 1, grant=False))
    flight.tick(60.0)
    flight.connected = True
    flight.tick(1.0)
    assert not flight.diverted
