"""What must be true of the vehicle, besides its place, before a release is sent."""

from __future__ import annotations

import pytest

from app.domain.drop.record import Certainty, DropOutcome
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.state import GnssFix
from tests.support.supervised_flight import TERMS, Flight


@pytest.mark.parametrize("fix", [GnssFix.NO_GPS, GnssFix.NO_FIX, GnssFix.FIX_2D])
def test_nothing_is_released_without_a_gnss_fix(fix: GnssFix) -> None:
    flight = Flight(gnss_fix=fix)
    flight.tick(TERMS.hold_s + 30.0)
    assert flight.sends_s == []
    assert flight.finish is not None
    assert (flight.finish.outcome, flight.finish.certainty) == (DropOutcome.KEPT, Certainty.INFERRED)
    assert flight.finish.reason == Reason.of(ReasonCode.NO_GNSS)


def test_a_fix_that_is_back_in_the_hold_allows_the_release() -> None:
    flight = Flight(gnss_fix=GnssFix.NO_GPS)
    flight.tick(10.0)
    flight.gnss_fix = GnssFix.FIX_3D
    flight.until_sent()


@pytest.mark.parametrize("fix", [None, GnssFix.FIX_3D, GnssFix.RTK_FIXED])
def test_a_fix_that_is_good_or_not_reported_prevents_nothing(fix: GnssFix | None) -> None:
    Flight(gnss_fix=fix).until_sent()


def test_a_fix_that_is_lost_between_two_attempts_prevents_the_second() -> None:
    flight = Flight()
    flight.until_sent()
    flight.gnss_fix = GnssFix.NO_GPS
    flight.time_out()
    flight.tick(5.0)
    assert len(flight.sends_s) == 1
