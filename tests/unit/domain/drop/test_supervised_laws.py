"""Laws of the supervised drop, with hold expiry, acks, link cuts, other pilots and set-current interleaved at will."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from app.domain.drop.consent import ConsentState
from app.domain.drop.record import DropOutcome, GripperUse
from app.domain.drop.supervised_inputs import ConsentGiven, Finish, ReleaseWithheld
from app.domain.vehicle.commands import MavResult
from app.domain.vehicle.state import FlightMode
from tests.support.supervised_flight import TERMS, Flight

REFUSALS = (MavResult.DENIED, MavResult.UNSUPPORTED, MavResult.FAILED)


class AnyFlight(RuleBasedStateMachine):
    """The vehicle executes what reaches it; the link loses, delays and doubles; others interfere."""

    terms = TERMS

    def __init__(self) -> None:
        super().__init__()
        self.flight = Flight(terms=self.terms)
        self.refused: set[int] = set()
        self.executed: set[int] = set()
        self.accepted = False
        self.used = False

    @rule(knows=st.booleans())
    @precondition(lambda self: self.flight.now_s == 100.0)
    def the_output_is_known_or_not(self, knows: bool) -> None:
        self.flight.knows_output = knows

    @rule(seconds=st.sampled_from([0.2, 0.4, 1.0, 5.0, 25.0]))
    def time_passes(self, seconds: float) -> None:
        self.flight.tick(seconds)

    @precondition(lambda self: bool(self.flight.sends_s))
    @rule()
    def a_sent_release_reaches_the_gripper(self) -> None:
        attempt = len(self.flight.sends_s)
        if attempt not in self.refused:
            self.executed.add(attempt)
            self.flight.gripper_open = True

    @precondition(lambda self: self.flight.machine.in_flight is not None)
    @rule(result=st.sampled_from(list(MavResult)), twice=st.booleans())
    def an_ack_comes(self, result: MavResult, twice: bool) -> None:
        attempt = self.flight.machine.in_flight
        assert attempt is not None
        if result in REFUSALS:
            if attempt in self.executed:
                return  # a vehicle does not refuse what it did
            self.refused.add(attempt)
        self.accepted = self.accepted or result is MavResult.ACCEPTED
        self.flight.ack(result, attempt=attempt)
        if twice:
            self.flight.ack(result, attempt=attempt)

    @rule(attempt=st.integers(0, 4), result=st.sampled_from(list(MavResult)))
    def a_stray_ack_comes(self, attempt: int, result: MavResult) -> None:
        if attempt != self.flight.machine.in_flight:
            before = self.flight.machine
            assert self.flight.ack(result, attempt=attempt) == ()
            assert self.flight.machine == before

    @precondition(lambda self: self.flight.machine.in_flight is not None)
    @rule()
    def no_ack_comes(self) -> None:
        self.flight.time_out()

    @precondition(lambda self: self.flight.machine.in_flight is not None and not self.executed)
    @rule()
    def the_release_is_withheld(self) -> None:
        attempt = self.flight.machine.in_flight
        assert attempt is not None
        self.refused.add(attempt)
        self.flight.feed(ReleaseWithheld(self.flight.now_s, attempt))

    @rule()
    def the_link_is_cut_or_comes_back(self) -> None:
        self.flight.connected = not self.flight.connected

    @rule(mode=st.sampled_from([FlightMode.MISSION, FlightMode.MISSION, FlightMode.HOLD, FlightMode.RETURN]))
    def somebody_changes_the_mode(self, mode: FlightMode) -> None:
        self.flight.mode = mode

    @rule(seq=st.integers(0, 5))
    def somebody_sets_the_current_item(self, seq: int) -> None:
        if self.flight.connected:
            self.flight.seq, self.flight.hold_began_s = seq, None
            if seq == TERMS.hold_seqs[0]:
                self.flight.offset_m = max(self.flight.offset_m, 3.0)

    @precondition(lambda self: self.flight.finish is None)
    @rule()
    def a_task_uses_the_gripper(self) -> None:
        self.used = True
        self.flight.machine = replace(self.flight.machine, used_by=GripperUse.TASK)

    @rule()
    def the_run_ends(self) -> None:
        self.flight.end()
        assert self.flight.finish is not None, "a run that ends leaves no drop open"

    @invariant()
    def a_release_is_sent_only_when_all_is_right(self) -> None:
        assert not self.flight.sent_while_unsafe

    @invariant()
    def never_more_tries_than_allowed(self) -> None:
        assert len(self.flight.sends_s) <= TERMS.max_attempts

    @invariant()
    def one_end_and_it_is_honest(self) -> None:
        finish: Finish | None = self.flight.finish
        if finish is None:
            return
        if self.used:
            assert finish.outcome is DropOutcome.UNKNOWN, "others used the gripper"
        if finish.outcome is DropOutcome.RELEASED:
            assert self.flight.sends_s, "released without a command"
            assert self.accepted or self.executed, "released without any evidence"
        if finish.outcome is DropOutcome.KEPT and not self.flight.knows_output:
            sent = set(range(1, len(self.flight.sends_s) + 1))
            assert sent <= self.refused, "kept, though a release that nobody refused may have acted"


class AnyFlightWithAnAlternate(AnyFlight):
    """The same with another place for the parcel."""

    terms = replace(TERMS, resume_seq=5, alternate_seq=4, leave_s=5.0)

    @rule()
    def the_hold_ends_in_vain(self) -> None:
        self.flight.tick(self.terms.hold_s)

    @invariant()
    def only_a_parcel_that_is_surely_on_board_goes_on_to_the_alternate(self) -> None:
        if self.flight.diverted:
            assert self.flight.finish is not None
            assert self.flight.finish.outcome is DropOutcome.KEPT
            assert set(range(1, len(self.flight.sends_s) + 1)) <= self.refused
            assert not self.accepted
            assert not self.executed


class AnyConsentedFlight(AnyFlightWithAnAlternate):
    """The same with an operator, who may say anything at any time."""

    terms = replace(AnyFlightWithAnAlternate.terms, needs_consent=True, consent_timeout_s=10.0)

    @rule(ticks=st.integers(1, 200))
    def it_is_asked_soon(self, ticks: int) -> None:
        for _ in range(ticks):
            if self.flight.machine.consent.state is ConsentState.ASKED:
                return
            self.flight.tick()

    @rule(grant=st.sampled_from([True, True, False]), stale=st.sampled_from([0, 0, 0, 1]), taken=st.booleans())
    def an_operator_answers(self, grant: bool, stale: int, taken: bool) -> None:
        question = self.flight.machine.consent.question - stale
        self.flight.feed(ConsentGiven(self.flight.now_s, question, grant))
        if taken:  # by a pilot, who gives it back at once
            self.flight.mode = FlightMode.HOLD
            self.flight.tick()
            self.flight.mode = FlightMode.MISSION
            self.flight.tick(5.0)

    @invariant()
    def a_question_has_an_end(self) -> None:
        consent = self.flight.machine.consent
        if consent.state is ConsentState.ASKED:
            assert not self.flight.machine.is_over
            assert self.flight.now_s < consent.deadline_s, "it must be closed at the first look after its time"


AnyConsentedFlight.TestCase.settings = settings(max_examples=100, stateful_step_count=30, deadline=None)
TestConsentedDropLaws = AnyConsentedFlight.TestCase
AnyFlightWithAnAlternate.TestCase.settings = settings(max_examples=100, stateful_step_count=30, deadline=None)
TestDropWithAnAlternateLaws = AnyFlightWithAnAlternate.TestCase
AnyFlight.TestCase.settings = settings(max_examples=100, stateful_step_count=30, deadline=None)
TestSupervisedDropLaws = AnyFlight.TestCase
