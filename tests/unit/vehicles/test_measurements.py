"""A measurement is shown no longer than it is known."""

from __future__ import annotations

import pytest

from app.domain.flight.modes import ModeTracker
from app.domain.vehicle.state import FlightMode, GnssFix
from app.vehicles.decoders import CurrentMode, GlobalPositionInt, GpsRawInt, Heartbeat
from app.vehicles.measurements import Measurements


@pytest.mark.parametrize(
    ("age_s", "shown"), [(0.0, (GnssFix.FIX_3D, 10, 0.7)), (4.9, (GnssFix.FIX_3D, 10, 0.7)), (5.1, (None, None, None))]
)
def test_gnss_is_unknown_again_once_its_message_stays_away(age_s: float, shown: tuple[object, ...]) -> None:
    measurements = Measurements()
    measurements.take_gnss(GpsRawInt(fix_type=3, eph=70, satellites_visible=10), 100.0)
    state = measurements.state(100.0 + age_s, connected=True)
    assert (state.gnss_fix, state.gnss_satellites, state.gnss_hdop) == shown


def position(boot_ms: int, north_m: int = 0) -> GlobalPositionInt:
    return GlobalPositionInt(boot_ms, 473977420 + north_m * 90, 85455940, 0, 0, 0, 0, 0, 65535)


def test_a_position_that_newer_ones_have_overtaken_is_left_out() -> None:
    measurements = Measurements()
    measurements.take_position(position(60_000, 10), 100.0)
    measurements.take_position(position(59_900, 9), 100.1)
    state = measurements.state(100.2, connected=True)
    assert state.boot_time_s == 60.0, "the end of a hold is counted on this clock: it must not run backwards"
    assert state.position_age_s == pytest.approx(0.2)


def test_after_a_reboot_positions_count_again() -> None:
    measurements = Measurements()
    for n in range(30):
        measurements.take_position(position(n * 5_000), 100.0 + n * 0.1)  # 50 times as fast as ours
    measurements.forget_after_reboot()
    measurements.take_position(position(1_000), 110.0)
    assert measurements.state(110.0, connected=True).boot_time_s == 1.0


HOLD, RETURN, POSITION, OFFBOARD = (main << 16 | sub << 24 for main, sub in ((4, 3), (4, 5), (3, 0), (6, 0)))


def heartbeat(custom_mode: int, *, failsafe: bool = False) -> Heartbeat:
    return Heartbeat(type=2, autopilot=12, base_mode=128, custom_mode=custom_mode, system_status=5 if failsafe else 4)


def test_a_failsafe_is_known_with_the_mode_that_it_chose_and_not_a_heartbeat_later() -> None:
    measurements = Measurements()
    measurements.take_heartbeat(heartbeat(OFFBOARD), 100.0)
    measurements.take_mode(CurrentMode(RETURN, OFFBOARD), 0.0)
    state = measurements.state(100.1, connected=True)
    assert (state.mode, state.in_failsafe) == (FlightMode.RETURN, True), "recording 18b: nobody else commanded it"


def test_a_pilot_who_takes_over_from_a_failsafe_is_no_failsafe_though_the_heartbeat_comes_later() -> None:
    measurements, sign = Measurements(), ModeTracker()
    measurements.take_heartbeat(heartbeat(RETURN, failsafe=True), 100.0)
    sign = sign.seen(measurements.state(100.0, connected=True), 100.0)
    measurements.take_mode(CurrentMode(POSITION, POSITION), 0.0)
    sign = sign.seen(measurements.state(100.1, connected=True), 100.1)
    measurements.take_heartbeat(heartbeat(POSITION), 101.0)
    sign = sign.seen(measurements.state(101.0, connected=True), 101.0)
    assert not sign.by_failsafe


def test_a_failsafe_that_goes_on_from_hold_to_return_stays_one() -> None:
    measurements = Measurements()
    measurements.take_heartbeat(heartbeat(OFFBOARD), 99.0)
    for mode in (HOLD, RETURN):
        measurements.take_mode(CurrentMode(mode, OFFBOARD), 0.0)
        assert measurements.state(100.0, connected=True).in_failsafe
        measurements.take_heartbeat(heartbeat(mode, failsafe=True), 100.5)
        assert measurements.state(101.0, connected=True).in_failsafe


def test_without_the_intended_mode_the_next_heartbeat_tells_of_the_failsafe() -> None:
    measurements = Measurements()
    measurements.take_heartbeat(heartbeat(OFFBOARD), 99.0)
    measurements.take_mode(CurrentMode(RETURN, 0), 0.0)
    assert not measurements.state(100.0, connected=True).in_failsafe
    measurements.take_heartbeat(heartbeat(RETURN, failsafe=True), 100.5)
    assert measurements.state(101.0, connected=True).in_failsafe


def test_a_mode_that_a_mode_executor_shows_as_its_own_is_no_failsafe() -> None:
    measurements = Measurements()
    measurements.take_heartbeat(heartbeat(HOLD), 99.0)
    measurements.take_mode(CurrentMode(4 << 16 | 11 << 24, HOLD), 0.0)
    assert not measurements.state(100.0, connected=True).in_failsafe


@pytest.mark.parametrize(
    ("before", "goes_back"), [((OFFBOARD, RETURN), True), ((OFFBOARD, POSITION, RETURN), False), ((RETURN,), False)]
)
def test_a_return_that_somebody_else_commanded_out_of_offboard_goes_back_there(
    before: tuple[int, ...], goes_back: bool
) -> None:
    measurements = Measurements()
    measurements.take_heartbeat(heartbeat(HOLD), 99.0)
    for mode in before:
        measurements.take_mode(CurrentMode(mode, mode), 0.0)
        measurements.take_heartbeat(heartbeat(mode), 100.0)
    assert measurements.goes_back_to_offboard is goes_back


MISSION = 4 << 16 | 4 << 24


def test_a_termination_is_told_by_heartbeat_alone_and_no_other_message_ends_it() -> None:
    """PX4 v1.19 shows the mode that was intended in both messages (flown)."""
    measurements = Measurements()
    measurements.take_heartbeat(heartbeat(MISSION), 100.0)
    terminated = Heartbeat(type=2, autopilot=12, base_mode=128, custom_mode=MISSION, system_status=8)
    assert measurements.take_heartbeat(terminated, 101.0) is not None, "it is told"
    measurements.take_mode(CurrentMode(HOLD, HOLD), 101.5)
    state = measurements.state(101.5, connected=True)
    assert (state.is_terminated, state.in_failsafe) == (True, True)
    measurements.take_heartbeat(heartbeat(MISSION), 102.0)
    assert not measurements.state(102.0, connected=True).is_terminated, "the kill switch was set back"


@pytest.mark.parametrize("mode", [MISSION, HOLD, RETURN])
def test_a_mere_warning_in_the_mode_that_was_asked_for_is_no_failsafe(mode: int) -> None:
    """A low battery alone would keep every parcel on board otherwise: PX4 says CRITICAL for it, too."""
    measurements = Measurements()
    measurements.take_heartbeat(heartbeat(mode, failsafe=True), 100.0)
    assert measurements.state(100.1, connected=True).in_failsafe, "the mode may be a failsafe's until more is known"
    assert measurements.take_mode(CurrentMode(mode, mode), 100.2) is not None, (
        "whoever waits for its end must hear of it"
    )
    measurements.take_heartbeat(heartbeat(mode, failsafe=True), 101.0)
    state = measurements.state(101.1, connected=True)
    assert (state.in_failsafe, state.may_be_in_failsafe) == (False, True)
    measurements.take_heartbeat(heartbeat(mode), 102.0)
    assert not measurements.state(102.1, connected=True).may_be_in_failsafe


def test_a_failsafe_that_follows_its_warning_is_one() -> None:
    measurements = Measurements()
    measurements.take_heartbeat(heartbeat(MISSION), 100.0)
    measurements.take_heartbeat(heartbeat(MISSION, failsafe=True), 101.0)
    assert not measurements.state(101.1, connected=True).in_failsafe
    measurements.take_mode(CurrentMode(HOLD, MISSION), 101.5)
    assert measurements.state(101.6, connected=True).in_failsafe, "it holds before it acts"
    measurements.take_heartbeat(heartbeat(RETURN, failsafe=True), 102.0)
    assert measurements.state(102.1, connected=True).in_failsafe


def test_whose_a_mode_is_that_a_heartbeat_shows_during_a_warning_tells_the_next_current_mode() -> None:
    """A Return by another station would be the failsafe's otherwise, in the run's reason until its end."""
    for intended, is_by_failsafe in ((RETURN, False), (MISSION, True)):
        measurements = Measurements()
        measurements.take_heartbeat(heartbeat(MISSION), 100.0)
        measurements.take_mode(CurrentMode(MISSION, MISSION), 100.1)
        measurements.take_heartbeat(heartbeat(MISSION, failsafe=True), 101.0)
        measurements.take_heartbeat(heartbeat(RETURN, failsafe=True), 102.0)
        assert not measurements.state(102.0, connected=True).in_failsafe
        measurements.take_mode(CurrentMode(RETURN, intended), 102.1)
        assert measurements.state(102.1, connected=True).in_failsafe is is_by_failsafe
        measurements.take_heartbeat(heartbeat(RETURN, failsafe=True), 103.0)
        assert measurements.state(103.0, connected=True).in_failsafe is is_by_failsafe
