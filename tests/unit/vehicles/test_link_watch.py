"""A vehicle's clock tells a restart from datagrams that come late, after others, or after the link stood still."""

from __future__ import annotations

from app.vehicles.link_watch import ClockAssessment, Timeline


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
