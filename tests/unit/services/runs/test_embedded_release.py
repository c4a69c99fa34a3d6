"""An embedded drop's record says of its own parcel what was seen, and nothing of where nobody looked."""

from __future__ import annotations

from app.domain.drop import Certainty, DropOutcome
from tests.unit.services.runs.embedded_flight import EmbeddedFlight, two_parcels


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
