"""A vehicle's clock tells a restart from datagrams that come late, after others, or after the link stood still."""

from __future__ import annotations

import pytest

from app.vehicles.link_watch import ClockAssessment, Fix, Timeline


def assessed(timeline: Timeline, *samples: tuple[float, int]) -> list[ClockAssessment | None]:
    """What the timeline makes of samples: when each is received, in seconds, and its time_boot_ms."""
    return [timeline.take(boot_ms, received_s) for received_s, boot_ms in samples]


def test_late_datagrams_after_a_silence_are_no_restart() -> None:
    timeline = Timeline()
    assert assessed(timeline, (100.0, 50_000), (100.1, 50_100)) == [None, None]
    late = assessed(timeline, (101.3, 50_020), (101.31, 50_040), (101.32, 50_060), (101.33, 50_080))
    assert ClockAssessment.REBOOTED not in late
    assert assessed(timeline, (101.4, 51_400)) == [None]


def test_a_clock_that_begins_anew_after_a_silence_is_a_restart() -> None:
    timeline = Timeline()
    assessed(timeline, (100.0, 50_000), (100.1, 50_100))
    began = assessed(timeline, (102.0, 800), (102.5, 1_300), (103.0, 1_800))
    assert began.count(ClockAssessment.REBOOTED) == 1
    assert assessed(timeline, (103.5, 2_300)) == [None]


def test_one_late_datagram_after_a_silence_is_no_restart_however_long_nothing_follows() -> None:
    timeline = Timeline()
    assessed(timeline, (100.0, 50_000), (100.1, 50_100))
    assert ClockAssessment.REBOOTED not in assessed(timeline, (105.0, 50_020))
    assert assessed(timeline, (110.0, 60_000)) == [None]


@pytest.mark.parametrize("later_s", [0.5, 1.7, 3.0, 8.0])
def test_a_slower_way_that_goes_on_alone_is_no_restart(later_s: float) -> None:
    """A router merges two ways to one vehicle, and the faster one ends."""
    timeline, boot_s = Timeline(), 600.0
    ticks = [n / 10 for n in range(150)]
    fast = [(100.0 + s, round((boot_s + s) * 1e3)) for s in ticks if s < 5.0]
    slow = [(100.01 + s + later_s, round((boot_s + s) * 1e3)) for s in ticks if s + later_s < 14.0]
    found = assessed(timeline, *sorted((*fast, *slow)))
    assert ClockAssessment.REBOOTED not in found
    assert found[-1] is None, "it goes on where the faster one ended"


def test_a_vehicle_that_restarts_without_a_silence_is_found_too() -> None:
    timeline = Timeline()
    assessed(timeline, (100.0, 50_000), (100.1, 50_100))
    began = assessed(timeline, *((100.3 + n / 10, 100 * n) for n in range(10)))
    assert began.count(ClockAssessment.REBOOTED) == 1


def test_a_simulated_vehicle_that_restarts_is_found_at_its_own_speed() -> None:
    timeline = Timeline()
    timeline.take(50_000, 100.0, rate=20.0)
    began = [timeline.take(2_000 * n, 100.1 + n / 10, rate=20.0) for n in range(10)]
    assert began.count(ClockAssessment.REBOOTED) == 1


def test_an_old_clock_that_nothing_goes_on_with_has_ended() -> None:
    timeline = Timeline()
    assessed(timeline, (100.0, 600_000))
    found = assessed(timeline, *((100.0 + s, 300_000 + 1000 * s) for s in range(1, 15)))
    assert found.count(ClockAssessment.REBOOTED) == 1


def test_a_vehicle_that_moves_fast_is_no_second_one_where_its_positions_come_late() -> None:
    timeline = Timeline()
    north = [Fix(47.0 + 20.0 * n / 10 / 111_320.0, 8.0, 20.0, 0.0) for n in range(100)]
    found = []
    for n in range(40, 100):
        found += [timeline.take(600_000 + 100 * n, 100.0 + n / 10, north[n])]
        found += [timeline.take(600_000 + 100 * (n - 30), 100.05 + n / 10, north[n - 30])]
    assert ClockAssessment.DUPLICATE not in found


def test_a_late_datagram_from_before_a_restart_is_no_second_one() -> None:
    timeline = Timeline()
    assessed(timeline, (100.0, 50_000), (100.1, 50_100))
    found = assessed(timeline, (102.0, 800), (102.5, 1_300), (102.6, 50_120))
    found += assessed(timeline, *((102.7 + n / 10, 1_500 + 100 * n) for n in range(150)))
    assert found.count(ClockAssessment.REBOOTED) == 1
    assert not timeline.is_in_doubt


def test_a_clock_far_ahead_that_speaks_seldom_hides_no_vehicle() -> None:
    timeline = Timeline()
    for n in range(300):
        assessed(timeline, (100.0 + n / 10, 50_000 + 100 * n))
        assert not timeline.is_in_doubt
        if n % 90 == 50:
            assessed(timeline, (100.05 + n / 10, 900_000 + 100 * n))


def test_two_clocks_in_turns_are_two_vehicles() -> None:
    timeline = Timeline()
    found = []
    for n in range(9):
        found += assessed(timeline, (100.0 + n / 10, 50_000 + 100 * n), (100.05 + n / 10, 90_000 + 100 * n))
    assert ClockAssessment.DUPLICATE in found


def test_a_clock_that_goes_on_far_ahead_is_believed() -> None:
    """After a standstill of a simulation that is much faster than was measured."""
    timeline = Timeline()
    found = assessed(timeline, (100.0, 50_000), (101.0, 100_000), (101.1, 105_000), (101.2, 110_000))
    assert ClockAssessment.REBOOTED not in found
    assert not timeline.is_in_doubt
