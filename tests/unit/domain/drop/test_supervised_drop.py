"""A supervised drop ends in a known state, whatever the link, the gripper or another pilot does."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from app.domain.drop.record import Certainty, DropOutcome, DropPhase
from app.domain.drop.supervised_inputs import OtherGripperItems, SendRelease
from app.domain.drop.supervised_state import DropMachine
from app.domain.reasons import Reason, ReasonCode, describe
from app.domain.vehicle.commands import MavResult
from app.domain.vehicle.state import FlightMode
from tests.support.supervised_flight import TERMS, Flight


def ended(flight: Flight) -> tuple[DropOutcome, Certainty]:
    assert flight.finish is not None, "the drop must have ended"
    return flight.finish.outcome, flight.finish.certainty


def test_a_release_that_is_acknowledged_ends_released_and_resumes() -> None:
    flight = Flight()
    flight.until_sent()
    flight.ack(MavResult.IN_PROGRESS)
    assert flight.finish is None, "IN_PROGRESS must not end a drop"
    flight.ack(MavResult.ACCEPTED)
    assert ended(flight) == (DropOutcome.RELEASED, Certainty.ACKNOWLEDGED)
    assert flight.resumed


def test_no_release_while_the_vehicle_still_moves() -> None:
    flight = Flight()
    while flight.moving:
        flight.tick()
        assert not flight.sends_s or not flight.moving
    assert not flight.sent_while_unsafe


def test_with_a_visible_output_accepted_alone_is_not_enough() -> None:
    flight = Flight(knows_output=True)
    flight.until_sent()
    flight.ack(MavResult.ACCEPTED)
    assert flight.finish is None
    flight.tick(2.0)
    assert ended(flight) == (DropOutcome.UNKNOWN, Certainty.NONE), "the output stayed at grab"


def test_with_a_visible_output_that_moves_the_release_is_acknowledged_not_sensed() -> None:
    flight = Flight(knows_output=True)
    flight.until_sent()
    flight.gripper_open = True
    flight.ack(MavResult.ACCEPTED)
    flight.tick()
    assert ended(flight) == (DropOutcome.RELEASED, Certainty.ACKNOWLEDGED)


def test_on_an_open_link_an_acknowledgement_alone_releases_nothing() -> None:
    flight = Flight(link_is_open=True)
    flight.until_sent()
    flight.ack(MavResult.ACCEPTED)
    assert ended(flight) == (DropOutcome.UNKNOWN, Certainty.NONE), "anyone could have sent it"
    assert flight.finish is not None
    assert flight.finish.reason.code is ReasonCode.DROP_ACKNOWLEDGED_ON_OPEN_LINK


def test_on_an_open_link_a_refusal_is_decided_by_the_output() -> None:
    flight = Flight(knows_output=True, link_is_open=True)
    flight.until_sent()
    flight.ack(MavResult.FAILED)
    assert flight.finish is None, "anyone could have sent it"
    flight.gripper_open = True
    flight.tick()
    assert ended(flight)[0] is DropOutcome.RELEASED


def test_a_refusal_keeps_the_parcel_and_flies_on() -> None:
    flight = Flight()
    flight.until_sent()
    flight.ack(MavResult.FAILED)
    assert ended(flight) == (DropOutcome.KEPT, Certainty.ACKNOWLEDGED)
    assert flight.resumed
    assert "FAILED" in describe(flight.finish.reason) if flight.finish else False


def test_a_lost_ack_is_retried_and_a_second_accepted_is_a_release() -> None:
    flight = Flight()
    flight.until_sent()
    flight.tick(1.0)
    flight.time_out()
    flight.until_sent(2)
    flight.ack(MavResult.ACCEPTED)
    assert ended(flight) == (DropOutcome.RELEASED, Certainty.ACKNOWLEDGED)
    assert len(flight.sends_s) == 2


def test_all_acks_lost_and_no_output_seen_is_unknown_never_kept() -> None:
    flight = Flight()
    for attempt in range(1, TERMS.max_attempts + 1):
        flight.until_sent(attempt)
        flight.tick(1.0)
        flight.time_out()
    flight.tick(1.0)
    assert ended(flight) == (DropOutcome.UNKNOWN, Certainty.NONE)
    assert len(flight.sends_s) == TERMS.max_attempts


def test_all_acks_lost_but_the_output_moved_is_a_release_by_inference() -> None:
    flight = Flight(knows_output=True)
    flight.until_sent()
    flight.gripper_open = True
    flight.tick(1.0)
    flight.time_out()
    flight.tick()
    assert ended(flight) == (DropOutcome.RELEASED, Certainty.INFERRED)


def test_an_output_that_went_to_release_counts_although_it_is_off_again_at_the_end() -> None:
    flight = Flight(knows_output=True)
    flight.until_sent()
    flight.gripper_open = True
    flight.tick(1.0)
    flight.gripper_open = False
    flight.tick(1.0)
    flight.end()
    assert ended(flight) == (DropOutcome.RELEASED, Certainty.INFERRED)
    assert "moved to release" in (describe(flight.finish.reason) if flight.finish else "")


def test_all_acks_lost_and_the_output_still_at_grab_is_kept_by_inference() -> None:
    flight = Flight(knows_output=True)
    for attempt in range(1, TERMS.max_attempts + 1):
        flight.until_sent(attempt)
        flight.time_out()
    flight.tick(1.0)
    assert ended(flight) == (DropOutcome.KEPT, Certainty.INFERRED)


def test_a_doubled_or_late_ack_changes_nothing_after_the_end() -> None:
    flight = Flight()
    flight.until_sent()
    flight.ack(MavResult.ACCEPTED)
    assert flight.ack(MavResult.FAILED, attempt=1) == ()
    assert flight.ack(MavResult.ACCEPTED, attempt=1) == ()
    assert ended(flight) == (DropOutcome.RELEASED, Certainty.ACKNOWLEDGED)


def test_an_ack_of_nobodys_release_is_ignored() -> None:
    flight = Flight()
    flight.tick()
    assert flight.ack(MavResult.ACCEPTED, attempt=1) == (), "the boot grab's ack is not a release"
    assert flight.finish is None


def test_the_link_cut_before_the_command_keeps_the_parcel() -> None:
    flight = Flight()
    flight.tick(1.0)
    flight.connected = False
    flight.tick(60.0)
    assert flight.finish is None, "without a link nothing is known"
    flight.connected = True
    flight.tick()
    assert ended(flight)[0] is DropOutcome.KEPT
    assert not flight.sends_s


def test_the_link_cut_after_the_command_waits_and_is_then_unknown() -> None:
    flight = Flight()
    flight.until_sent()
    flight.connected = False
    flight.time_out()
    flight.tick(60.0)
    assert flight.finish is None
    flight.connected = True
    flight.tick()
    assert ended(flight) == (DropOutcome.UNKNOWN, Certainty.NONE)
    assert len(flight.sends_s) == 1, "a release is never sent after the hold"


def test_somebody_elses_mode_stops_the_drop_and_is_not_fought() -> None:
    flight = Flight()
    while flight.machine.phase is not DropPhase.HOLDING:
        flight.tick()
    flight.mode = FlightMode.POSITION
    flight.tick(30.0)
    assert not flight.sends_s
    assert not flight.resumed
    flight.end()
    assert ended(flight)[0] is DropOutcome.KEPT


def test_a_hold_entered_again_after_a_pause_counts_from_the_pause() -> None:
    flight = Flight()
    while flight.machine.phase is not DropPhase.HOLDING:
        flight.tick()
    flight.mode = FlightMode.HOLD
    flight.tick(60.0)
    flight.mode = FlightMode.MISSION
    flight.until_sent()
    assert len(flight.sends_s) == 1
    assert not flight.sent_while_unsafe


def test_set_current_over_the_drop_keeps_the_parcel() -> None:
    flight = Flight()
    flight.tick(0.5)
    flight.seq = 5
    flight.tick()
    assert ended(flight)[0] is DropOutcome.KEPT
    assert not flight.resumed


def test_a_stale_index_of_an_earlier_flight_is_not_a_passed_drop() -> None:
    flight = Flight(seq=5)
    flight.tick(1.0)
    assert flight.finish is None
    flight.seq, flight.offset_m = 2, 20.0
    flight.until_sent()
    assert len(flight.sends_s) == 1


def test_a_hold_whose_start_was_not_seen_is_never_used() -> None:
    flight = Flight(offset_m=0.2)
    flight.tick(3.0)
    assert not flight.sends_s
    assert ended(flight)[0] is DropOutcome.KEPT


def test_a_hold_that_ends_before_the_vehicle_is_at_its_point_is_the_reason() -> None:
    flight = Flight(dataclasses.replace(TERMS, hold_s=1.0))
    flight.tick(6.0)
    assert not flight.sends_s
    assert flight.finish is not None
    assert [*flight.finish.reason.codes] == [ReasonCode.DROP_HOLD_OVER_AS, ReasonCode.TOO_FAR]


def test_near_the_end_of_its_hold_the_mission_is_left_to_go_on_by_itself() -> None:
    flight = Flight()
    flight.until_sent()
    flight.tick(TERMS.hold_s - 3.0)
    flight.ack(MavResult.ACCEPTED)
    assert ended(flight)[0] is DropOutcome.RELEASED
    assert not flight.resumed, "a late set_current would fly it back"


def test_an_open_gripper_before_the_command_is_unknown() -> None:
    flight = Flight(knows_output=True, gripper_open=True)
    flight.tick(20.0)
    assert not flight.sends_s
    assert ended(flight) == (DropOutcome.UNKNOWN, Certainty.NONE)


def test_a_position_that_is_too_old_never_allows_a_release() -> None:
    flight = Flight()
    while flight.moving:
        flight.tick()
    flight.position_frozen_at_s = flight.now_s - 1.5
    flight.sends_s.clear()
    machine_before = flight.machine
    flight.tick(5.0)
    assert flight.machine.attempts == machine_before.attempts or not flight.sends_s


def test_busy_is_tried_again_within_the_hold() -> None:
    flight = Flight()
    flight.until_sent()
    flight.ack(MavResult.TEMPORARILY_REJECTED)
    flight.until_sent(2)
    assert flight.sends_s[1] - flight.sends_s[0] >= TERMS.retry_pause_s


def test_after_our_restart_a_commanded_release_is_never_sent_again() -> None:
    flight = Flight()
    flight.machine = DropMachine.recovered(TERMS, attempts=1)
    flight.tick(40.0)
    assert not any(isinstance(e, SendRelease) for e in flight.effects)
    assert ended(flight) == (DropOutcome.UNKNOWN, Certainty.NONE)
    assert flight.finish is not None
    assert flight.finish.reason == Reason.of(ReasonCode.DROP_ACK_MISSING, attempts=1), "it counts what was sent"


@pytest.mark.parametrize(
    ("knows_output", "is_open", "link_is_open", "expected", "code"),
    [
        (True, True, False, (DropOutcome.RELEASED, Certainty.ACKNOWLEDGED), ReasonCode.DROP_ACKNOWLEDGED_MOVED),
        (True, False, False, (DropOutcome.UNKNOWN, Certainty.NONE), ReasonCode.DROP_ACKNOWLEDGED_NOT_MOVED),
        (False, False, False, (DropOutcome.RELEASED, Certainty.ACKNOWLEDGED), ReasonCode.DROP_ACKNOWLEDGED_UNSEEN),
        (False, False, True, (DropOutcome.UNKNOWN, Certainty.NONE), ReasonCode.DROP_ACKNOWLEDGED_ON_OPEN_LINK),
    ],
)
def test_after_our_restart_an_acceptance_that_was_recorded_counts(
    knows_output: bool,
    is_open: bool,
    link_is_open: bool,
    expected: tuple[DropOutcome, Certainty],
    code: ReasonCode,
) -> None:
    flight = Flight(knows_output=knows_output, gripper_open=is_open, link_is_open=link_is_open)
    flight.machine = DropMachine.recovered(TERMS, attempts=1, accepted=True)
    flight.tick(TERMS.output_wait_s + 1.0)
    assert ended(flight) == expected
    assert flight.finish is not None
    assert flight.finish.reason is not None
    assert flight.finish.reason.code is code
    assert not any(isinstance(e, SendRelease) for e in flight.effects)


def test_after_our_restart_an_acceptance_that_was_recorded_counts_though_the_vehicle_is_never_heard_again() -> None:
    flight = Flight()
    flight.machine = DropMachine.recovered(TERMS, attempts=1, accepted=True)
    flight.end()
    assert ended(flight) == (DropOutcome.RELEASED, Certainty.ACKNOWLEDGED)
    assert flight.finish is not None
    assert flight.finish.reason is not None
    assert flight.finish.reason.code is ReasonCode.DROP_ACKNOWLEDGED_THEN


def test_after_our_restart_amid_a_hold_it_is_not_said_to_be_over() -> None:
    flight = Flight(offset_m=0.0)
    flight.machine = DropMachine.recovered(TERMS, attempts=1)
    flight.tick(TERMS.output_wait_s + 1.0)
    assert flight.finish is not None
    assert flight.finish.reason == Reason.of(ReasonCode.DROP_ACK_MISSING, attempts=1)


KEPT, RELEASED = (DropOutcome.KEPT, Certainty.INFERRED), (DropOutcome.RELEASED, Certainty.INFERRED)
UNKNOWN = (DropOutcome.UNKNOWN, Certainty.NONE)
OTHERS = OtherGripperItems(releases=frozenset({7}), grabs=frozenset({5}))
"""The mission goes on with a grab, and with another release."""


@pytest.mark.parametrize(
    ("seq", "is_open", "returns", "expected"),
    [
        (4, False, False, KEPT),
        (5, False, False, UNKNOWN),
        (6, False, False, UNKNOWN),
        (1, False, False, UNKNOWN),
        (4, False, True, UNKNOWN),
        (6, True, False, RELEASED),
        (7, True, False, UNKNOWN),
        (8, True, False, UNKNOWN),
        (1, True, False, UNKNOWN),
        (4, True, True, UNKNOWN),
    ],
)
def test_after_our_restart_the_output_tells_nothing_if_another_gripper_item_may_have_moved_it(
    seq: int, is_open: bool, returns: bool, expected: tuple[DropOutcome, Certainty]
) -> None:
    terms = dataclasses.replace(TERMS, others=dataclasses.replace(OTHERS, returns=returns))
    flight = Flight(terms=terms, knows_output=True, gripper_open=is_open, seq=seq)
    flight.machine = DropMachine.recovered(terms, attempts=1)
    flight.tick(2.0)
    flight.end()
    assert ended(flight) == expected


@pytest.mark.parametrize(("seq", "is_open"), [(6, False), (8, True)])
def test_after_a_silence_the_output_tells_nothing_if_another_gripper_item_may_have_moved_it(
    seq: int, is_open: bool
) -> None:
    flight = Flight(terms=dataclasses.replace(TERMS, others=OTHERS), knows_output=True)
    flight.until_sent()
    flight.connected = False
    flight.time_out()
    flight.tick(30.0)
    flight.seq, flight.gripper_open, flight.connected = seq, is_open, True
    flight.tick()
    assert ended(flight) == UNKNOWN


def test_in_a_hold_that_was_observed_throughout_no_other_visit_moved_the_output() -> None:
    flight = Flight(
        terms=dataclasses.replace(TERMS, others=dataclasses.replace(OTHERS, returns=True)), knows_output=True
    )
    for attempt in range(1, TERMS.max_attempts + 1):
        flight.until_sent(attempt)
        flight.time_out()
    flight.tick(1.0)
    assert ended(flight) == KEPT


def test_the_hold_is_counted_on_the_vehicles_clock() -> None:
    """At a speed factor of 4 a hold of 20 s lasts 5 s of ours."""
    flight = Flight()
    while flight.machine.phase is not DropPhase.HOLDING:
        flight.tick()
    seen = dataclasses.replace(flight.observation(), clock_rate=4.0)
    left_s = flight.machine.hold.left_s(seen, TERMS)
    assert left_s <= TERMS.hold_s / 4.0


@pytest.mark.parametrize("before_m", [0.5, 1.5, 4.0])
@pytest.mark.parametrize(
    "silent_s", [3.0, 12.0, TERMS.hold_s - 1.0, TERMS.hold_s, TERMS.hold_s + 2.0, 2 * TERMS.hold_s]
)
def test_what_waited_on_its_way_does_not_prolong_the_hold(before_m: float, silent_s: float) -> None:
    """The link stands still near the drop, and then delivers in order and at once what was sent meanwhile."""
    flight = Flight()
    while flight.offset_m > before_m:
        flight.tick()
    for late in flight.held_back(silent_s):
        flight.now_s += 0.02
        flight.feed(dataclasses.replace(late, now_s=flight.now_s, position_age_s=0.0))
    flight.tick(30.0)
    assert flight.sent_while_unsafe == []
    assert silent_s > 12.0 or flight.sends_s, "there was time enough"


def test_a_clock_that_seems_fast_for_a_moment_ends_no_hold() -> None:
    """After a short standstill of the link the vehicle's clock is measured too fast for a while."""
    flight = Flight(terms=dataclasses.replace(TERMS, needs_consent=True))
    while flight.machine.phase is not DropPhase.ASKING:
        flight.tick()
    flight.tick(10.0)
    for _ in range(10):
        flight.feed(dataclasses.replace(flight.observation(), clock_rate=2.0, position_age_s=0.3))
    flight.tick(4.0)
    assert flight.machine.phase is DropPhase.ASKING


@pytest.mark.parametrize(
    "stray",
    [{"mission_seq": 1, "mission_is_sure": False}, {"mode": FlightMode.HOLD, "mode_is_commanded": True}],
    ids=["one late MISSION_CURRENT", "a pause that nobody obeys"],
)
def test_what_does_not_end_a_hold_does_not_prolong_it(stray: dict[str, Any]) -> None:
    flight = Flight(terms=dataclasses.replace(TERMS, needs_consent=True))
    while flight.machine.phase is not DropPhase.ASKING:
        flight.tick()
    flight.tick(8.0)
    before_s = flight.machine.hold.left_s(flight.observation(), TERMS)
    flight.feed(dataclasses.replace(flight.observation(), **stray))
    assert flight.machine.hold.left_s(flight.observation(), TERMS) == pytest.approx(before_s)
