"""A recorded flight is decided again as it was; what today's code decides otherwise is named with its moment."""

from __future__ import annotations

from app.domain.flight.flight import Flight
from app.domain.flight.inputs import FlightInput
from app.domain.flight.recording import Line, Recorder, as_text, began, from_text
from app.domain.flight.step import step
from tests.support.flown_flights import a_flight, a_run


def recorded(given: list[FlightInput]) -> tuple[list[Line], Flight]:
    """The lines of a flight, read again from text, and how it ended."""
    flight = a_flight(a_run())
    lines, recorder = [began(flight)], Recorder()
    for one in given:
        flight, effects = step(flight, one)
        lines.append(recorder.line(one, effects))
    return list(from_text(as_text(lines))), flight
