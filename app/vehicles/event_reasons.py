"""PX4 EVENTs in words, for reasons that no STATUSTEXT tells.

PX4 names an event by a hash and keeps the words in metadata that a ground station must fetch. These few say why a
mission was not accepted or a failsafe acts; recorded from PX4 v1.18 (main, 2026-08). Others are left out.
"""

from __future__ import annotations

from typing import Final

from app.domain.ports import StatusText
from app.vehicles.decoders import EventReport

_WORDS: Final = {
    19546926: ("error", "Mission rejected: add a landing item or remove the takeoff"),
    21551397: ("error", "Mission rejected: the landing glide slope is steeper than the vehicle allows"),
    25237137: ("error", "Mission rejected: landing waypoint or pattern required"),
    33440290: ("error", "Mission rejected: takeoff is not the first waypoint item"),
    22091529: ("warning", "First waypoint far away from home"),
    27571288: ("error", "Connection to ground control station lost"),
    28241790: ("error", "No offboard signal"),
}


def reason_of(event: EventReport) -> StatusText | None:
    """The event as a text; None if it is none of those."""
    words = _WORDS.get(event.id)
    return None if words is None else StatusText(severity=words[0], text=words[1])
