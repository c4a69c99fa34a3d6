"""An embedded drop's record says of its own parcel what was seen, and nothing of where nobody looked."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.drop.record import Certainty, DropOutcome, DropRecord, OutputEvidence
from app.domain.mission import MavCmd
from app.domain.reasons import describe
from app.domain.vehicle.state import LandedState
from tests.support.embedded_flight import EmbeddedFlight, two_parcels


def test_each_of_two_parcels_is_released_by_its_own_item() -> None:
    flight = EmbeddedFlight(two_parcels())
    flight.tick(current=flight.seq("clinic"))
    flight.wait(2)
    flight.tick(gripper_output_us=1000)
    assert flight.record("drop").outcome is DropOutcome.RELEASED
    assert flight.record("drop2").outcome is DropOutcome.PENDING, "its parcel is not even on board yet"
    flight.tick(current=flight.seq("depot"))
    flight.wait(3)
    assert flight.record("drop2").outcome is DropOutcome.PENDING
    flight.tick(gripper_output_us=2000, current=flight.seq("school"))
    flight.wait(2)
    flight.tick(gripper_output_us=1000)
    drop2 = flight.record("drop2")
    assert (drop2.outcome, drop2.certainty) == (DropOutcome.RELEASED, Certainty.INFERRED)


@pytest.mark.parametrize(
    ("has_output", "evidence", "words"),
    [
        (False, OutputEvidence.NOT_ASSIGNED, "no output is assigned to the gripper"),
        (None, OutputEvidence.NOT_KNOWN, "output is unknown"),
    ],
)
def test_reached_without_a_known_output_is_unknown_with_a_code(
    has_output: bool | None, evidence: OutputEvidence, words: str
) -> None:
    flight = EmbeddedFlight(two_parcels())
    flight.tick(current=flight.seq("clinic"), gripper_output_us=None, has_gripper_output=has_output)
    flight.tick(5, current=flight.seq("depot"))
    flight.wait(3)
    drop = flight.record("drop")
    assert (drop.outcome, drop.certainty, drop.output_evidence) == (DropOutcome.UNKNOWN, Certainty.NONE, evidence)
    assert words in describe(drop.reason)


def test_a_winch_is_unknown_because_nothing_shows_what_it_does() -> None:
    mission = two_parcels()
    winches = tuple(replace(drop, command=MavCmd.DO_WINCH) for drop in mission.drops)
    flight = EmbeddedFlight(replace(mission, drops=winches))
    flight.tick(current=flight.seq("clinic"), gripper_output_us=2000)
    flight.tick(5, current=flight.seq("depot"))
    flight.wait(3)
    drop = flight.record("drop")
    assert drop.outcome is DropOutcome.UNKNOWN
    assert "telemetry does not show what a winch does" in describe(drop.reason)
    assert "output" not in describe(drop.reason)


def test_a_second_parcel_that_was_never_grabbed_is_unknown() -> None:
    flight = EmbeddedFlight(two_parcels())
    flight.tick(current=flight.seq("clinic"))
    flight.wait(2)
    flight.tick(gripper_output_us=1000)
    for item in ("depot", "school", "home"):
        flight.tick(5, current=flight.seq(item))
        flight.wait(3)
    assert flight.record("drop2").outcome is DropOutcome.UNKNOWN


def test_both_items_passed_unseen_say_nothing_of_the_first_parcel() -> None:
    flight = EmbeddedFlight(two_parcels())
    flight.tick(current=flight.seq("clinic"))
    flight.tick(connected=False)
    flight.tick(60, connected=True, current=flight.seq("home"), gripper_output_us=1000)
    flight.wait(3)
    assert flight.record("drop").outcome is DropOutcome.UNKNOWN
    assert flight.record("drop2").outcome is DropOutcome.UNKNOWN


MEASURED = ("latitude_deg", "longitude_deg", "offset_m", "ground_speed_m_s", "landed", "gnss_fix", "battery_percent")


def measured(record: DropRecord) -> set[object]:
    return {getattr(record, name) for name in MEASURED}


def test_where_the_vehicle_was_is_of_the_moment_at_which_the_item_passed() -> None:
    flight = EmbeddedFlight(two_parcels())
    flight.tick(current=flight.seq("clinic"))
    flight.wait(2)
    flight.tick(latitude_deg=47.39828, gripper_output_us=1000)
    flight.tick(latitude_deg=47.5, current=flight.seq("depot"))
    flight.wait(3)
    assert flight.record("drop").latitude_deg == 47.39828


@pytest.mark.parametrize("back_s", [0.0, 0.9])
def test_after_a_gap_of_the_link_nobody_knows_where_the_item_passed(back_s: float) -> None:
    flight = EmbeddedFlight(two_parcels())
    flight.tick(current=flight.seq("clinic"))
    flight.wait(2)
    flight.tick(connected=False)
    flight.tick(60, connected=True, latitude_deg=47.5, landed=LandedState.ON_GROUND, gripper_output_us=900)
    flight.wait(back_s)
    flight.tick(current=flight.seq("depot"))
    flight.wait(3)
    drop = flight.record("drop")
    assert drop.outcome is DropOutcome.UNKNOWN
    assert measured(drop) == {None}
    assert "not observed when the item passed" in describe(drop.reason)


def test_a_silence_that_is_too_short_for_a_lost_link_is_a_gap_too() -> None:
    flight = EmbeddedFlight(two_parcels())
    flight.tick(current=flight.seq("clinic"))
    flight.wait(2)
    flight.tick(2, position_age_s=2.0)
    flight.tick(position_age_s=0.1, gripper_output_us=1000)
    drop = flight.record("drop")
    assert drop.outcome is DropOutcome.RELEASED
    assert measured(drop) == {None}


def test_after_a_restart_of_ours_nobody_knows_where_the_item_passed() -> None:
    flight = EmbeddedFlight(two_parcels(), taken_up=True)
    flight.tick(current=flight.seq("depot"))
    flight.wait(3)
    assert measured(flight.record("drop")) == {None}


def test_an_old_output_is_noted_with_the_time_at_which_it_was_seen() -> None:
    flight = EmbeddedFlight(two_parcels())
    flight.tick(current=flight.seq("clinic"))
    flight.wait(2)
    flight.tick(gripper_output_us=1000, gripper_output_age_s=1.5)
    drop = flight.record("drop")
    assert drop.output_at == pytest.approx(flight.now_s + 1e9 - 1.5)
