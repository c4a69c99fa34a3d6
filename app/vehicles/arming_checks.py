"""What keeps a vehicle from being armed or flown in a mode, as its newest health report says.

PX4 sends a report when it changes, and not when an arming is refused: "Arming denied: Resolve system health failures
first" is all that follows the request. A report is a summary and one EVENT for each check that fails; the STATUSTEXTs
of the same checks come with it, some before and some after.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from app.domain.vehicle.state import FlightMode
from app.vehicles.event_reasons import Reason

_OF_REPORT_S: Final = 0.5
"""A STATUSTEXT comes so much before the summary of its report at most; both go the same way."""
_RECENT_S: Final = 10.0
"""Texts of a firmware that sends no summary count for so long."""
_KEPT: Final = 32
_PREFIX: Final = "Preflight"
_FAILS: Final = "Preflight Fail"
"""The same text without the word is a warning: PX4 arms all the same."""


def is_of_check(text: str) -> bool:
    """Whether a STATUSTEXT is of the health report, not of what was commanded or uploaded."""
    return text.startswith(_PREFIX)


class _Text(NamedTuple):
    text: str
    at_s: float


class ArmingChecks:
    """The checks that fail now."""

    def __init__(self) -> None:
        self._is_reported = False
        self._checks: dict[str, Reason] = {}
        self._texts: list[_Text] = []

    def begin(self, at_s: float) -> None:
        """A report begins: what it does not repeat does not fail any more."""
        self._is_reported = True
        self._checks.clear()
        self._texts = [text for text in self._texts if at_s - text.at_s <= _OF_REPORT_S]

    def add(self, reason: Reason) -> None:
        """A check of the report that has begun."""
        self._checks[reason.text.text] = reason

    def add_text(self, text: str, at_s: float) -> None:
        """A STATUSTEXT; those of checks that fail count."""
        if text.startswith(_FAILS):
            self._texts = [*(known for known in self._texts if known.text != text), _Text(text, at_s)][-_KEPT:]

    def failing(self, mode: FlightMode, now_s: float) -> tuple[str, ...]:
        """In words: checks that fail for `mode`, then texts, of which no mode is known."""
        checks = [text for text, reason in self._checks.items() if reason.concerns(mode)]
        recent = [text.text for text in self._texts if self._is_reported or now_s - text.at_s <= _RECENT_S]
        return (*checks, *recent)
