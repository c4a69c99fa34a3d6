"""What one message says is no fact: the next real one takes a forged one back."""

from __future__ import annotations

from app.vehicles.decoders import CurrentMode, Heartbeat
from app.vehicles.measurements import Measurements
from app.vehicles.steadiness import GAP_S, LONGEST_S, OUTPUT_SURE_S, Span, SteadyOutput


def beat(custom_mode: int, *, status: int) -> Heartbeat:
    return Heartbeat(type=2, autopilot=12, base_mode=0x9D, custom_mode=custom_mode, system_status=status)


def test_a_span_counts_from_the_first_message_to_the_newest() -> None:
    span = Span()
    for at_s in (10.0, 11.0, 12.0):
        span.observe(True, at_s)
    assert span.length_s == 2.0


def test_one_message_that_says_otherwise_begins_the_span_anew() -> None:
    span = Span()
    for holds, at_s in ((True, 10.0), (True, 12.0), (False, 12.5), (True, 13.0), (True, 13.4)):
        span.observe(holds, at_s)
    assert span.length_s == 0.4


def test_a_gap_begins_the_span_anew_and_silence_does_not_lengthen_it() -> None:
    span = Span()
    span.observe(True, 10.0)
    span.observe(True, 10.0 + GAP_S + 0.1)
    assert span.length_s == 0.0


def test_a_span_is_told_up_to_its_longest() -> None:
    span = Span()
    for at_s in range(0, 100, 4):
        span.observe(True, float(at_s))
    assert span.length_s == LONGEST_S


def test_an_output_counts_once_it_was_said_for_long_enough() -> None:
    output = SteadyOutput()
    assert not output.observe(2000, 10.0)
    assert output.us is None
    assert output.observe(2000, 10.0 + OUTPUT_SURE_S)
    assert output.us == 2000


def test_forged_outputs_between_the_real_ones_change_nothing() -> None:
    output = SteadyOutput()
    output.observe(2000, 9.0)
    output.observe(2000, 10.0)
    for step in range(100):
        at_s = 10.0 + step / 10
        output.observe(2000, at_s)
        assert not output.observe(1000, at_s + 0.05), "the real output says otherwise ten times a second"
    assert output.us == 2000
    assert output.newest_us == 1000


def test_the_delay_before_a_failsafe_acts_is_no_pause_under_a_warning() -> None:
    """As flown: Hold with Mission as the intended mode. With a mere warning HEARTBEAT is CRITICAL in a pause, too."""
    measured, mission, hold = Measurements(), 0x4040000, 0x3040000
    measured.take_heartbeat(beat(mission, status=4), 0.5)
    measured.take_mode(CurrentMode(hold, mission), 1.0)
    assert measured.state(1.0, connected=True).failsafe_delay_s == 0.0, "before the next HEARTBEAT"
    for at_s in (2.0, 3.0):
        measured.take_heartbeat(beat(hold, status=5), at_s)
    assert measured.state(3.0, connected=True).failsafe_delay_s == 2.0
    measured.take_mode(CurrentMode(hold, hold), 3.5)
    measured.take_heartbeat(beat(hold, status=5), 4.0)
    assert measured.state(4.0, connected=True).failsafe_delay_s is None
