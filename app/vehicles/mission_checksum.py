"""The id that PX4 gives a list of mission items: MISSION_ACK.opaque_id and MISSION_CURRENT.mission_id.

PX4 (mavlink_mission.cpp, crc32_for_mission_item): a CRC-32 over each item as received, packed without gaps as frame,
command, autocontinue, param1..4, x, y, z. Equal to the ids of all uploads in recordings of PX4 v1.18 (main, 2026-08).
When the vehicle's id is the one computed here, it holds the list that was sent, without reading it back.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from typing import Final

from app.vehicles.mission_wire import WireItem

_ITEM: Final = struct.Struct("<BHBffffiif")
_ALL_ONES: Final = 0xFFFFFFFF


def mission_checksum(items: Sequence[WireItem]) -> int:
    """The id of these items, 0 for none. NaN counts as the quiet NaN that the wire carries."""
    crc = 0
    for item in items:
        packed = _ITEM.pack(
            item.frame,
            item.command,
            item.autocontinue,
            item.param1,
            item.param2,
            item.param3,
            item.param4,
            item.x,
            item.y,
            item.z,
        )
        # PX4's crc32part has neither the initial nor the final inversion of zlib's
        crc = zlib.crc32(packed, crc ^ _ALL_ONES) ^ _ALL_ONES
    return crc
