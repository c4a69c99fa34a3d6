"""A recorded flight is decided again as it was; what today's code decides otherwise is named with its moment."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from hypothesis import given, settings

from app.domain.flight.inputs import FlightInput
from app.domain.flight.recording import Recorder, as_text, replay
from app.domain.flight.step import step
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
def test_any_flight_is_decided_again_as_it_was(heard: list[FlightInput]) -> None:
    lines, ended = recorded(heard)
    found = replay(lines)
    assert (found.inputs, found.differences, found.run) == (len(heard), (), ended.run)


def test_what_is_decided_otherwise_is_named_with_its_moment() -> None:
    flown = Flown()
    flown.to_the_end()
    lines, _ = recorded(flown.seen)
    at = next(number for number, line in enumerate(lines) if "ReleaseOrder" in json.dumps(line))
    lines[at]["effects"] = [effect for effect in lines[at]["effects"] if "order" not in effect]
    (found,) = replay(lines).differences
    assert (found.heard, found.at_s) == ("Looked", pytest.approx(lines[at]["sight"]["now_s"] - lines[0]["now_s"]))
    assert [effect["order"] for effect in found.today if "order" in effect] == ["ReleaseOrder"]


def test_what_others_change_of_the_run_is_recorded_with_the_next_input() -> None:
    flown = Flown()
    for _ in range(5):
        flown.tick()
    recorder = Recorder(flown.run)
    changed = flown.run.model_copy(update={"upload_percent": 100.0})
    flight = replace(flown.flight, run=changed)
    after, effects = step(flight, flown.seen[-1])
    assert recorder.line(changed, flown.seen[-1], after, effects)["run"] == {"upload_percent": 100.0}


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
