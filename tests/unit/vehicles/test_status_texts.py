"""Texts are joined, and one that comes again and again is counted instead of told."""

from __future__ import annotations

import random
import time

import pytest

from app.domain.vehicle.facts import StatusText
from app.domain.vehicle.state import FlightMode
from app.vehicles.decoders import EventReport, StatusTextChunk
from app.vehicles.status_texts import StatusTexts


def chunk(text: str, severity: int = 6, number: int = 0, seq: int = 0) -> StatusTextChunk:
    return StatusTextChunk(severity, text, number, seq)


def test_a_text_that_is_repeated_is_told_twice_with_its_count() -> None:
    told: list[StatusText] = []
    texts = StatusTexts(told.append)
    for number in range(200):
        texts.take(chunk("GPS glitch"), number * 0.04)
        texts.tick(number * 0.04)
    assert told == [StatusText("info", "GPS glitch")]
    texts.tick(10.1)
    assert told[1:] == [StatusText("info", "GPS glitch", repeated=199, last_age_s=pytest.approx(10.1 - 199 * 0.04))]
    texts.tick(30.0)
    assert len(told) == 2


def test_a_count_says_how_long_ago_the_last_repetition_was() -> None:
    """Told ten seconds after the first one, it is no news: the vehicle may fly by then."""
    told: list[StatusText] = []
    texts = StatusTexts(told.append)
    for at_s in (0.0, 2.0, 4.0):
        texts.take(chunk("Arming denied", 2), at_s)
    texts.tick(10.1)
    assert [(text.repeated, text.last_age_s) for text in told] == [(0, None), (2, pytest.approx(6.1))]
    texts.take(chunk("Arming denied", 2), 20.0)
    texts.take(chunk("Arming denied", 2), 21.0)
    texts.take(chunk("Arming denied", 2), 33.0)
    assert [(text.repeated, text.last_age_s) for text in told[2:]] == [(0, None), (1, 12.0), (0, None)]


def test_what_could_steer_a_terminal_is_removed_where_a_text_enters() -> None:
    told: list[StatusText] = []
    StatusTexts(told.append).take(chunk("\x1b[2J\u202eGeofence\nbreached\x00"), 0.0)
    assert [text.text for text in told] == ["Geofence breached"]


def test_a_text_of_nothing_that_can_be_seen_is_not_told() -> None:
    told: list[StatusText] = []
    StatusTexts(told.append).take(chunk("\x1b[2J\u200b"), 0.0)
    assert told == []


def test_a_text_of_another_severity_is_another_text() -> None:
    told: list[StatusText] = []
    texts = StatusTexts(told.append)
    texts.take(chunk("Low battery", 4), 0.0)
    texts.take(chunk("Low battery", 2), 0.1)
    assert [text.severity for text in told] == ["warning", "critical"]


def test_a_text_that_comes_later_is_told_again() -> None:
    told: list[StatusText] = []
    texts = StatusTexts(told.append)
    texts.take(chunk("Takeoff detected"), 0.0)
    texts.take(chunk("Takeoff detected"), 10.5)
    assert told == [StatusText("info", "Takeoff detected")] * 2


def test_nothing_is_lost_of_many_different_texts_and_their_repetitions() -> None:
    told: list[StatusText] = []
    texts, rng, sent = StatusTexts(told.append), random.Random(3), [0] * 300
    for number in range(5000):
        which = rng.randrange(len(sent))
        sent[which] += 1
        texts.take(chunk(f"text {which}"), number * 0.01)
    texts.tick(1000.0)
    for which, count in enumerate(sent):
        own = [text for text in told if text.text == f"text {which}"]
        assert sum(text.repeated or 1 for text in own) == count


def test_the_reasons_of_a_refusal_are_found_also_when_they_were_repeated() -> None:
    texts = StatusTexts(lambda text: None)
    texts.take(chunk("Arming denied: not ready", 2), 0.0)
    texts.take(chunk("Arming denied: not ready", 2), 5.0)
    assert texts.reasons_since(4.0) == ("Arming denied: not ready",)


def test_a_reason_is_found_however_many_texts_follow_that_are_none() -> None:
    texts = StatusTexts(lambda text: None)
    texts.take(chunk("Arming denied: not ready", 2), 1.0)
    for number in range(1000):
        texts.take(chunk(f"text {number}"), 1.0)
    assert texts.reasons_since(0.0) == ("Arming denied: not ready",)


def test_chunks_are_joined_and_a_lost_end_is_told_without_it() -> None:
    told: list[StatusText] = []
    texts = StatusTexts(told.append)
    texts.take(chunk("a" * 50, 6, 7, 0), 0.0)
    texts.take(chunk("b", 6, 7, 1), 0.1)
    texts.take(chunk("c" * 50, 6, 8, 0), 0.2)
    texts.tick(5.0)
    assert [text.text for text in told] == ["a" * 50 + "b", "c" * 50]


NO_OFFBOARD_SIGNAL, NO_LOCAL_POSITION, SUMMARY = 28241790, 30612409, 27825120


def check(event_id: int, modes: int = 0) -> EventReport:
    return EventReport(event_id, modes.to_bytes(4, "little") + bytes(36))


def test_a_check_is_told_only_where_a_delivery_or_the_present_mode_needs_it() -> None:
    told: list[StatusText] = []
    texts = StatusTexts(told.append)
    texts.take_event(check(NO_OFFBOARD_SIGNAL, 0x4000), 0.0, FlightMode.POSITION, None)
    assert told == []
    texts.take_event(check(NO_LOCAL_POSITION, 0x7E00FC), 0.1, FlightMode.POSITION, None)
    texts.take_event(check(NO_OFFBOARD_SIGNAL, 0x4000), 0.2, FlightMode.HOLD, FlightMode.OFFBOARD)
    assert [text.text for text in told] == ["Navigation error: No valid position estimate", "No offboard signal"]


def test_the_checks_that_fail_now_are_those_of_the_newest_report_and_its_texts() -> None:
    """As recorded: a report when it changes, its STATUSTEXT just before or just after, and none with the refusal."""
    texts = StatusTexts(lambda text: None)
    texts.take(chunk("Preflight Fail: GPS fix too low", 4), 5.0)
    texts.take_event(check(SUMMARY), 5.001)
    texts.take_event(check(NO_OFFBOARD_SIGNAL, 0x4000), 5.002)
    texts.take_event(check(NO_LOCAL_POSITION, 0x7E00FC), 5.003)
    texts.take(chunk("Preflight Fail: Compass not calibrated", 2), 5.004)
    texts.take(chunk("Preflight: Strong magnetic interference", 4), 5.005)  # a warning: it arms all the same
    texts.take(chunk("Arming denied: Resolve system health failures first", 2), 9.0)
    assert texts.failing_checks(FlightMode.HOLD) == (
        "Navigation error: No valid position estimate",
        "Preflight Fail: GPS fix too low",
        "Preflight Fail: Compass not calibrated",
    )
    assert texts.failing_checks(FlightMode.OFFBOARD)[0] == "No offboard signal"
    texts.take_event(check(SUMMARY), 20.0)
    assert texts.failing_checks(FlightMode.HOLD) == ()


def test_without_a_report_a_text_of_a_check_counts_for_ten_seconds() -> None:
    texts, now_s = StatusTexts(lambda text: None), time.monotonic()
    texts.take(chunk("Preflight Fail: Compass not calibrated", 2), now_s - 11.0)
    texts.take(chunk("Preflight Fail: Accel not calibrated", 2), now_s)
    assert texts.failing_checks(FlightMode.HOLD) == ("Preflight Fail: Accel not calibrated",)
