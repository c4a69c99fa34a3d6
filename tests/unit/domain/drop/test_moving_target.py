"""A drop at a moving target: released only while it is known where the target is, and it is under the vehicle."""

from __future__ import annotations

from dataclasses import dataclass, replace

import pytest

from app.domain.drop.record import DropOutcome
from app.domain.drop.supervised_inputs import DropObservation, TargetObservation
from app.domain.vehicle.commands import MavResult
from tests.support.supervised_flight import TERMS, Flight

AT_TARGET = replace(TERMS, target_max_speed_m_s=2.0)
HERE = TargetObservation(age_s=0.5, distance_m=1.0, speed_m_s=1.0)


@dataclass
class Ship(Flight):
    """The flight, and what is known of its target."""

    target: TargetObservation | None = HERE

    def observation(self) -> DropObservation:
        return replace(super().observation(), target=self.target)


def test_the_parcel_is_released_while_the_target_is_here() -> None:
    flight = Ship(AT_TARGET)
    flight.until_sent()
    flight.ack(MavResult.ACCEPTED)
    assert flight.finish is not None
    assert flight.finish.outcome is DropOutcome.RELEASED


@pytest.mark.parametrize(
    ("target", "code"),
    [
        (None, "drop.target_unknown"),
        (replace(HERE, age_s=5.1), "drop.target_stale"),
        (replace(HERE, age_s=float("nan")), "drop.target_stale"),
        (replace(HERE, distance_m=2.1), "drop.target_away"),
        (replace(HERE, distance_m=None), "drop.target_away"),
        (replace(HERE, speed_m_s=2.1), "drop.target_too_fast"),
    ],
)
def test_the_parcel_is_kept_when_the_hold_ends_without_the_target(target: TargetObservation | None, code: str) -> None:
    flight = Ship(AT_TARGET, target=target)
    flight.tick(60)
    assert flight.sends_s == []
    assert flight.finish is not None
    assert flight.finish.outcome is DropOutcome.KEPT
    assert flight.finish.reason.code == code


@pytest.mark.parametrize("target", [None, replace(HERE, age_s=5.1), replace(HERE, distance_m=500.0)])
def test_with_an_alternate_the_vehicle_goes_there_when_its_hold_ended_without_the_target(
    target: TargetObservation | None,
) -> None:
    flight = Ship(replace(AT_TARGET, resume_seq=5, alternate_seq=4, leave_s=5.0), target=target)
    flight.tick(20)
    assert not flight.diverted, "the target may still come"
    flight.tick(20)
    assert (flight.diverted, flight.sends_s) == (True, [])


def test_the_vehicle_waits_for_the_target_within_its_hold() -> None:
    flight = Ship(AT_TARGET, target=replace(HERE, distance_m=9.0))
    flight.tick(15)
    assert flight.sends_s == []
    flight.target = HERE
    flight.tick()
    assert len(flight.sends_s) == 1


def test_a_release_that_was_ordered_is_not_sent_when_the_target_has_gone() -> None:
    flight = Ship(AT_TARGET)
    flight.until_sent()
    assert flight.machine.may_send(flight.observation())
    flight.target = replace(HERE, distance_m=2.1)
    assert not flight.machine.may_send(flight.observation())


def test_a_drop_without_a_target_asks_for_none() -> None:
    flight = Ship(TERMS, target=None)
    flight.until_sent()
    assert len(flight.sends_s) == 1
