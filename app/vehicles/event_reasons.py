"""PX4 EVENTs in words, for reasons that no STATUSTEXT gives.

PX4 names an event by a hash and keeps the words in metadata that a ground station must fetch. These few say why a
mission was not accepted, why the vehicle does not arm or why a failsafe acts; recorded from PX4 v1.18 (main, 2026-08),
the words as in its source. Others are left out: most arming checks are said as a STATUSTEXT too ("Preflight Fail: ").
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto
from typing import Final, NamedTuple

from app.domain.vehicle.facts import MavSeverity, StatusText
from app.domain.vehicle.state import FlightMode
from app.vehicles.decoders import EventReport


class Topic(Enum):
    """What a reason is about. PX4 sends its health report anew at each upload, whatever was uploaded."""

    MISSION = auto()
    HEALTH = auto()


class Reason(NamedTuple):
    """An event in words. `modes` are those that an arming check keeps from being armed or flown in; None: all."""

    text: StatusText
    topic: Topic
    modes: frozenset[FlightMode] | None = None
    is_check: bool = False

    def concerns(self, *modes: FlightMode | None) -> bool:
        """Whether it is about one of these modes."""
        return self.modes is None or not self.modes.isdisjoint(modes)


def _reason(severity: MavSeverity, text: str, topic: Topic) -> Reason:
    return Reason(StatusText(severity=severity, text=text), topic)


def _error(text: str, topic: Topic = Topic.HEALTH) -> Reason:
    return _reason(MavSeverity.ERROR, text, topic)


def _critical(text: str) -> Reason:
    return _reason(MavSeverity.CRITICAL, text, Topic.HEALTH)


_REASONS: Final = {
    19546926: _error("Mission rejected: add a landing item or remove the takeoff", Topic.MISSION),
    21551397: _error("Mission rejected: the landing glide slope is steeper than the vehicle allows", Topic.MISSION),
    25237137: _error("Mission rejected: landing waypoint or pattern required", Topic.MISSION),
    33440290: _error("Mission rejected: takeoff is not the first waypoint item", Topic.MISSION),
    22091529: _reason(MavSeverity.WARNING, "First waypoint far away from home", Topic.MISSION),
    27571288: _error("Connection to ground control station lost"),
}
_CHECKS: Final = {
    26420585: _critical("Angular velocity not valid"),
    27227279: _critical("No valid attitude estimate"),
    29467116: _critical("Navigation error: No valid altitude estimate"),
    30612409: _error("Navigation error: No valid position estimate"),
    26788467: _error("Navigation error: No valid global position estimate"),
    33043131: _error("Offboard requires attitude estimate"),
    30456230: _error("Offboard requires local position"),
    29489462: _error("Offboard requires local velocity"),
    28241790: _error("No offboard signal"),
    31421834: _error("Maximum flight time reached"),
    22481569: _error("Arm authorization denied"),
    21826980: _critical("Low battery"),
}
"""Arming checks that no STATUSTEXT says, or one without a mark that it is of a check."""
_SUMMARY: Final = 27825120
_MODES_BYTES: Final = 4
_ALL_MODES: Final = 0xFFFFFFFF
_NAV_STATES: Final[Mapping[int, FlightMode]] = {
    0: FlightMode.MANUAL,
    1: FlightMode.ALTITUDE,
    2: FlightMode.POSITION,
    3: FlightMode.MISSION,
    4: FlightMode.HOLD,
    5: FlightMode.RETURN,
    12: FlightMode.DESCEND,
    14: FlightMode.OFFBOARD,
    15: FlightMode.STABILIZED,
    17: FlightMode.TAKEOFF,
    18: FlightMode.LAND,
    20: FlightMode.LAND,
    21: FlightMode.ORBIT,
    22: FlightMode.TAKEOFF,
}
"""NAVIGATION_STATE of VehicleStatus.msg: the bit of a mode in an arming check."""


def reason_of(event: EventReport) -> Reason | None:
    """The event as a reason; None if it is none of those."""
    check = _CHECKS.get(event.id)
    return _REASONS.get(event.id) if check is None else check._replace(modes=_modes(event), is_check=True)


def begins_report(event: EventReport) -> bool:
    """Whether a health report begins: all checks that fail now follow, and those that do not fail any more do not."""
    return event.id == _SUMMARY


def _modes(event: EventReport) -> frozenset[FlightMode] | None:
    """The first argument of each arming check."""
    bits = int.from_bytes(event.arguments[:_MODES_BYTES], "little")
    if bits in (0, _ALL_MODES):
        return None
    return frozenset(mode for number, mode in _NAV_STATES.items() if bits >> number & 1)
