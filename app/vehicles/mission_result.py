"""MAV_MISSION_RESULT: what a MISSION_ACK says, and which refusals are worth another try."""

from __future__ import annotations

from enum import IntEnum
from typing import Final


class MissionResult(IntEnum):
    """MAV_MISSION_RESULT."""

    ACCEPTED = 0
    ERROR = 1
    UNSUPPORTED_FRAME = 2
    UNSUPPORTED = 3
    NO_SPACE = 4
    INVALID = 5
    INVALID_PARAM1 = 6
    INVALID_PARAM2 = 7
    INVALID_PARAM3 = 8
    INVALID_PARAM4 = 9
    INVALID_PARAM5_X = 10
    INVALID_PARAM6_Y = 11
    INVALID_PARAM7 = 12
    INVALID_SEQUENCE = 13
    DENIED = 14
    OPERATION_CANCELLED = 15


PASSING: Final = frozenset({MissionResult.ERROR, MissionResult.INVALID_SEQUENCE, MissionResult.OPERATION_CANCELLED})
"""PX4 says ERROR when another transfer is under way, or items came out of turn: it may pass. The others will not."""


def result_word(number: int) -> str:
    """The name in MAV_MISSION_RESULT."""
    return MissionResult(number).name if number in MissionResult._value2member_map_ else f"MAV_MISSION_RESULT {number}"
