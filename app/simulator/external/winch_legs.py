"""What the drum does for each action of a winch: legs, each to a length of line at a rate."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntFlag

FULL_LENGTH_M = 30.0
DEFAULT_RATE_M_S = 1.0
FASTEST_M_S = 3.0
SLOW_M_S = 0.5
SLOW_BELOW_M = 1.0
"""The last of the way down is slow, feeling for the ground."""
RETRACT_M_S = 2.0
HOOK_M = 0.5
RELEASE_S = 0.5
"""At the ground, until the payload is off the hook."""


class Flag(IntFlag):
    """MAV_WINCH_STATUS_FLAG."""

    HEALTHY = 1
    FULLY_RETRACTED = 2
    MOVING = 4
    CLUTCH_ENGAGED = 8
    LOCKED = 16
    DROPPING = 32
    ARRESTING = 64
    GROUND_SENSE = 128
    RETRACTING = 256
    ABANDON_LINE = 1024
    LOAD_LINE = 4096
    LOAD_PAYLOAD = 8192


MOVING_ONLY = Flag(0)


@dataclass(frozen=True, slots=True)
class Leg:
    """To `target_m` of line let out."""

    target_m: float
    rate_m_s: float
    flags: Flag = MOVING_ONLY
    releases: bool = False
    """At its end the payload stands on the ground."""


def let_out(target_m: float, rate_m_s: float) -> list[Leg]:
    """To a length within the line's; a rate that is not given (0 or NaN) is the winch's own."""
    rate = abs(rate_m_s) if math.isfinite(rate_m_s) and rate_m_s != 0.0 else DEFAULT_RATE_M_S
    return [Leg(max(0.0, min(FULL_LENGTH_M, target_m)), min(rate, FASTEST_M_S))]


def deliver(height_m: float) -> list[Leg]:
    """Drop, slow down, touch down, reel up (and lock); nothing when the line does not reach the ground."""
    if height_m > FULL_LENGTH_M:
        return []
    return [
        Leg(max(0.0, height_m - SLOW_BELOW_M), FASTEST_M_S, Flag.DROPPING),
        Leg(max(0.0, height_m), SLOW_M_S, Flag.ARRESTING | Flag.GROUND_SENSE, releases=True),
        Leg(0.0, RETRACT_M_S, Flag.RETRACTING),
    ]


def retract() -> list[Leg]:
    """All the line in."""
    return [Leg(0.0, RETRACT_M_S, Flag.RETRACTING)]


def load_line() -> list[Leg]:
    """Wind a new line on, until the tension says that it is all there."""
    return [Leg(0.0, DEFAULT_RATE_M_S, Flag.LOAD_LINE)]


def abandon() -> list[Leg]:
    """Let out the entire line; it is lost then."""
    return [Leg(FULL_LENGTH_M, FASTEST_M_S, Flag.ABANDON_LINE)]


def present_hook() -> list[Leg]:
    """Just enough line that somebody can hang the payload on."""
    return [Leg(HOOK_M, DEFAULT_RATE_M_S, Flag.LOAD_PAYLOAD)]
