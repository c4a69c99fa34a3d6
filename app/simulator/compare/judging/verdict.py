"""What a judge says about one aspect, and the tolerances that all judges share."""

from __future__ import annotations

from dataclasses import dataclass

TOLERANCE = 0.2
"""A time may differ by this share, or by one period of the message that shows it, whichever is more."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """`compared` counts what was looked at; `differences` says in words what was not alike."""

    aspect: str
    compared: int
    differences: tuple[str, ...] = ()


def times_agree(recorded_s: float, simulated_s: float, period_s: float) -> bool:
    """Within TOLERANCE of the recorded time, or one period."""
    return abs(recorded_s - simulated_s) <= max(TOLERANCE * abs(recorded_s), period_s) + 1e-6
