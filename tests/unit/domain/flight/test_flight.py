"""The end of a run says where its vehicle was heard last: somebody may have to fetch it."""

from __future__ import annotations

import pytest

from app.domain.run.run import LastPosition, RunState
from app.domain.vehicle.state import FlightMode
from tests.support.flown_flights import BEGAN_AT, BEGAN_S
from tests.support.told_flight import Told

AWAY = {"latitude_deg": 47.4, "longitude_deg": 8.55}


def test_a_run_that_ends_says_where_the_vehicle_stands() -> None:
    told = Told()
    told.return_at_end()
    told.see(3.0, mode=FlightMode.LAND, in_failsafe=True, **AWAY)
    assert told.run.last_position is None, "the vehicle's own state says where it is in flight"
    told.touch_down()
    told.disarm(FlightMode.HOLD)
    assert told.run.state is RunState.FAILED
    at = BEGAN_AT + told.now_s - BEGAN_S
    heard = told.run.last_position
    assert heard is not None
    assert heard.at == pytest.approx(at, abs=6.0), "while it waited for its messages to agree"
    assert (heard.latitude_deg, heard.longitude_deg) == tuple(AWAY.values())


def test_a_lost_run_says_where_and_when_its_vehicle_was_heard() -> None:
    told = Told()
    told.see(5.0, **AWAY)
    heard_s = told.now_s
    for _ in range(4000):
        if told.run.is_over:
            break
        told.see(1.0, connected=False, position_age_s=told.now_s + 1.0 - heard_s)
    assert told.run.state is RunState.LOST
    heard = told.run.last_position
    assert heard == LastPosition(**AWAY, at=heard.at if heard else 0.0)
    assert heard.at == pytest.approx(BEGAN_AT + heard_s - BEGAN_S, abs=1.5)


def test_a_run_whose_vehicle_sent_no_position_has_none() -> None:
    told = Told()
    told.return_at_end()
    told.see(position_age_s=None, latitude_deg=None, longitude_deg=None)
    told.touch_down()
    told.disarm(FlightMode.HOLD)
    assert told.run.is_over
    assert told.run.last_position is None
