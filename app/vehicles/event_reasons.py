"""PX4 EVENTs in words, for reasons that no STATUSTEXT tells.

PX4 names an event by a hash and keeps the words in metadata that a ground station must fetch. These few say why a
mission was not accepted or a failsafe acts; recorded from PX4 v1.18 (main, 2026-08). Others are left out.
"""

from __future__ import annotations

from enum import Enum, auto
from typing import Final, NamedTuple

from app.domain.ports import StatusText
from app.vehicles.decoders import EventReport


class Topic(Enum):
    """What a reason is about. PX4 sends its health report anew at each upload, whatever was uploaded."""

    MISSION = auto()
    HEALTH = auto()


class Reason(NamedTuple):
    """An event in words."""

    text: StatusText
    topic: Topic


def _reason(severity: str, text: str, topic: Topic) -> Reason:
    return Reason(StatusText(severity=severity, text=text), topic)


_REASONS: Final = {
    19546926: _reason("error", "Mission rejected: add a landing item or remove the takeoff", Topic.MISSION),
    21551397: _reason(
        "error", "Mission rejected: the landing glide slope is steeper than the vehicle allows", Topic.MISSION
    ),
    25237137: _reason("error", "Mission rejected: landing waypoint or pattern required", Topic.MISSION),
    33440290: _reason("error", "Mission rejected: takeoff is not the first waypoint item", Topic.MISSION),
    22091529: _reason("warning", "First waypoint far away from home", Topic.MISSION),
    27571288: _reason("error", "Connection to ground control station lost", Topic.HEALTH),
    28241790: _reason("error", "No offboard signal", Topic.HEALTH),
}


def reason_of(event: EventReport) -> Reason | None:
    """The event as a reason; None if it is none of those."""
    return _REASONS.get(event.id)
