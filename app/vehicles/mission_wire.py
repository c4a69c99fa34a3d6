"""Mission items between the domain and the wire, and whether a vehicle holds what was sent."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import replace
from enum import IntEnum
from operator import attrgetter
from typing import Any, Final, NamedTuple

from app.domain.errors import LinkError
from app.domain.mission import MavCmd, MavFrame, MissionItem, MissionType


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


_VALUES: Final = ("param1", "param2", "param3", "param4", "x", "y", "z")
"""Fields that are the same in the domain and on the wire."""
_RELATIVE = {MavFrame.GLOBAL_RELATIVE_ALT, MavFrame.GLOBAL_RELATIVE_ALT_INT}
_GLOBAL = {MavFrame.GLOBAL, MavFrame.GLOBAL_INT}


class WireItem(NamedTuple):
    """A MISSION_ITEM_INT as numbers, whatever they are."""

    seq: int
    frame: int
    command: int
    current: int
    autocontinue: int
    param1: float
    param2: float
    param3: float
    param4: float
    x: int
    y: int
    z: float
    mission_type: int


def to_wire(items: Sequence[MissionItem]) -> list[WireItem]:
    """As sent: exactly item 0 is current, so that the vehicle starts there."""
    return [
        WireItem(
            seq=item.seq,
            frame=int(item.frame),
            command=int(item.command),
            current=int(item.seq == 0),
            autocontinue=int(item.autocontinue),
            mission_type=int(item.mission_type),
            **_values_of(item),
        )
        for item in items
    ]


def from_wire(items: Sequence[WireItem]) -> tuple[MissionItem, ...]:
    """As read back. Raises LinkError for an item that Waydrop has no word for (another ground station's mission)."""
    return tuple(_item_of(item) for item in items)


def _item_of(wire: WireItem) -> MissionItem:
    try:
        frame, command = MavFrame(wire.frame), MavCmd(wire.command)
    except ValueError as error:
        raise LinkError(
            f"item {wire.seq} on the vehicle has command {wire.command} in frame {wire.frame}, unknown to Waydrop",
            item_seq=wire.seq,
        ) from error
    return MissionItem(
        seq=wire.seq,
        frame=frame,
        command=command,
        current=bool(wire.current),
        autocontinue=bool(wire.autocontinue),
        mission_type=MissionType(wire.mission_type),
        **_values_of(wire),
    )


def _values_of(item: MissionItem | WireItem) -> dict[str, Any]:
    return {name: getattr(item, name) for name in _VALUES}


def first_difference(sent: Sequence[MissionItem], held: Sequence[MissionItem]) -> int | None:
    """The seq of the first item that differs (or is missing or too many); None if the lists are equal.

    PX4 gives fence points back in frame 5 without autocontinue: both mean nothing there, so they are not compared.
    """
    for one, other in zip(sent, held, strict=False):
        if not _plain(one).same_as(_plain(other)):
            return one.seq
    return None if len(sent) == len(held) else min(len(sent), len(held))


def _plain(item: MissionItem) -> MissionItem:
    if item.mission_type is not MissionType.MISSION:
        return replace(item, frame=MavFrame.GLOBAL_INT, autocontinue=True)
    if item.frame in _RELATIVE:
        return replace(item, frame=MavFrame.GLOBAL_RELATIVE_ALT_INT)
    if item.frame in _GLOBAL:
        return replace(item, frame=MavFrame.GLOBAL_INT)
    return item


# The id that PX4 gives a list of mission items: MISSION_ACK.opaque_id and MISSION_CURRENT.mission_id.
#
# PX4 (mavlink_mission.cpp, crc32_for_mission_item): a CRC-32 over each item as received, packed without gaps as
# frame, command, autocontinue, param1..4, x, y, z. Equal to the ids of all uploads in recordings of PX4 v1.18 (main,
# 2026-08). When the vehicle's id is the one computed here, it holds the list that was sent, without reading it back.


_ITEM: Final = struct.Struct("<BHBffffiif")
_PACKED: Final = attrgetter(
    *("frame", "command", "autocontinue", "param1", "param2", "param3", "param4", "x", "y", "z"),
)
_ALL_ONES: Final = 0xFFFFFFFF


def mission_checksum(items: Sequence[WireItem]) -> int:
    """The id of these items, 0 for none. NaN counts as the quiet NaN that the wire carries."""
    crc = 0
    for item in items:
        packed = _ITEM.pack(*_PACKED(item))
        # PX4's crc32part has neither the initial nor the final inversion of zlib's
        crc = zlib.crc32(packed, crc ^ _ALL_ONES) ^ _ALL_ONES
    return crc
