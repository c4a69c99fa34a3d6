"""PX4's EVENTs in words, and for which modes an arming check fails."""

from __future__ import annotations

import pytest

from app.domain.vehicle.state import FlightMode
from app.vehicles.decoders import EventReport
from app.vehicles.event_reasons import begins_report, reason_of

NO_OFFBOARD_SIGNAL, NO_LOCAL_POSITION, GCS_LOST, SUMMARY = 28241790, 30612409, 27571288, 27825120


def check(event_id: int, modes: int, component: int = 20) -> EventReport:
    """An arming check as PX4 sends it: the modes as bits, and the component."""
    return EventReport(event_id, modes.to_bytes(4, "little") + bytes([component]) + bytes(35))


def test_a_check_is_about_the_modes_that_it_names_alone() -> None:
    """As recorded: "No offboard signal" comes with each health report, for offboard mode (bit 14) only."""
    reason = reason_of(check(NO_OFFBOARD_SIGNAL, 0x4000))
    assert reason is not None
    assert reason.modes == {FlightMode.OFFBOARD}
    assert reason.concerns(FlightMode.OFFBOARD)
    assert not reason.concerns(FlightMode.HOLD, FlightMode.MISSION)


def test_a_lost_position_concerns_what_a_delivery_is_flown_in() -> None:
    reason = reason_of(check(NO_LOCAL_POSITION, 0x7E00FC))
    assert reason is not None
    assert (reason.text.severity, reason.text.text) == ("error", "Navigation error: No valid position estimate")
    assert {FlightMode.HOLD, FlightMode.MISSION, FlightMode.RETURN, FlightMode.LAND} <= (reason.modes or set())
    assert not reason.concerns(FlightMode.MANUAL, FlightMode.OFFBOARD)


@pytest.mark.parametrize("mode", FlightMode)
def test_a_check_for_all_modes_concerns_each(mode: FlightMode) -> None:
    reason = reason_of(check(NO_LOCAL_POSITION, 0xFFFFFFFF))
    assert reason is not None
    assert reason.concerns(mode)


@pytest.mark.parametrize("event_id", [GCS_LOST, 33440290])
def test_an_event_that_is_no_check_concerns_all_modes(event_id: int) -> None:
    reason = reason_of(EventReport(event_id, bytes(40)))
    assert reason is not None
    assert reason.concerns(FlightMode.MISSION)


def test_a_check_without_arguments_concerns_all_modes() -> None:
    reason = reason_of(EventReport(NO_OFFBOARD_SIGNAL, b""))
    assert reason is not None
    assert reason.concerns(FlightMode.HOLD)


def test_a_report_begins_with_its_summary() -> None:
    assert begins_report(EventReport(SUMMARY, bytes(40)))
    assert not begins_report(check(NO_OFFBOARD_SIGNAL, 0x4000))
