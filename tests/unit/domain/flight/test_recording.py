"""A recorded flight is decided again as it was; what today's code decides otherwise is named with its moment."""

from __future__ import annotations

import json

import pytest
from hypothesis import given, settings

from app.domain.flight.inputs import FlightInput
from app.domain.flight.recording import as_text, replay
from tests.support.flown_flights import Flown
from tests.support.recorded_flight import recorded
from tests.support.stepped_flight import inputs


def test_a_whole_flight_is_decided_again_as_it_was() -> None:
    flown = Flown()
    flown.to_the_end()
    lines, ended = recorded(flown.seen)
    found = replay(lines)
    assert (found.inputs, found.differences, found.run) == (len(flown.seen), (), ended.run)


@given(inputs())
@settings(max_examples=100, deadline=None)
def test_any_flight_is_decided_again_as_it_was(given: list[FlightInput]) -> None:
    lines, ended = recorded(given)
    found = replay(lines)
    assert (found.inputs, found.differences, found.run) == (len(given), (), ended.run)


def test_what_is_decided_otherwise_is_named_with_its_moment() -> None:
    flown = Flown()
    flown.to_the_end()
    lines, _ = recorded(flown.seen)
    at = next(number for number, line in enumerate(lines) if "ReleaseCommand" in json.dumps(line))
    lines[at]["effects"] = [effect for effect in lines[at]["effects"] if "command" not in effect]
    (found,) = replay(lines).differences
    at_s = lines[at]["observed"]["now_s"] - lines[0]["now_s"]
    assert (found.input, found.at_s) == ("Observed", pytest.approx(at_s))
    assert [effect["command"] for effect in found.today if "command" in effect] == ["ReleaseCommand"]


def test_a_recording_without_its_beginning_is_refused() -> None:
    flown = Flown()
    flown.tick()
    lines, _ = recorded(flown.seen)
    with pytest.raises(ValueError, match="does not describe the initial flight"):
        replay(lines[1:])


def test_a_minute_of_a_flight_takes_little_room() -> None:
    flown = Flown()
    flown.to_the_end()
    text = as_text(recorded(flown.seen)[0])
    assert len(text) / (flown.now_s - 1000.0) < 5000, "bytes a second, before it is packed"
