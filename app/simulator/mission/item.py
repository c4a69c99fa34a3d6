"""One mission item as the autopilot keeps it."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

from app.simulator.dialect import Message, mavlink
from app.simulator.wire import Cmd

_PACKED = struct.Struct("<BHB4fiif")

POSITION_COMMANDS = frozenset(
    {
        Cmd.NAV_WAYPOINT,
        Cmd.NAV_LOITER_UNLIM,
        Cmd.NAV_LOITER_TIME,
        Cmd.NAV_LAND,
        Cmd.NAV_TAKEOFF,
        Cmd.NAV_LOITER_TO_ALT,
        Cmd.NAV_VTOL_TAKEOFF,
        Cmd.NAV_VTOL_LAND,
    }
)
TAKEOFF_COMMANDS = frozenset({Cmd.NAV_TAKEOFF, Cmd.NAV_VTOL_TAKEOFF})
LAND_COMMANDS = frozenset({Cmd.NAV_LAND, Cmd.NAV_VTOL_LAND})
RELATIVE_FRAMES = frozenset({3, 6})


@dataclass(frozen=True, slots=True)
class Item:
    """MISSION_ITEM_INT without addressing. `x`, `y` are degrees x 1e7 in global frames; NaN is "not given"."""

    command: int
    frame: int
    autocontinue: int
    param1: float
    param2: float
    param3: float
    param4: float
    x: int
    y: int
    z: float

    @property
    def has_position(self) -> bool:
        """The vehicle flies to it."""
        return self.command in POSITION_COMMANDS

    @property
    def latitude_deg(self) -> float:
        """Of a position item."""
        return self.x / 1e7

    @property
    def longitude_deg(self) -> float:
        """Of a position item."""
        return self.y / 1e7

    @property
    def is_relative(self) -> bool:
        """`z` is above home, not above mean sea level."""
        return self.frame in RELATIVE_FRAMES


def from_message(message: Message) -> Item:
    """Read MISSION_ITEM_INT, or MISSION_ITEM (floats in degrees), as received."""
    x, y = message.x, message.y
    if message.get_type() == "MISSION_ITEM":
        scale = 1e7 if message.frame in (0, 3, 5, 6) else 1.0
        x, y = (round(v * scale) if math.isfinite(v) else 0 for v in (x, y))
    return Item(
        command=int(message.command),
        frame=int(message.frame),
        autocontinue=int(message.autocontinue),
        param1=message.param1,
        param2=message.param2,
        param3=message.param3,
        param4=message.param4,
        x=x,
        y=y,
        z=message.z,
    )


def to_message(item: Item, seq: int, current: bool, target: tuple[int, int], mission_type: int) -> Message:
    """MISSION_ITEM_INT for a download."""
    return mavlink.MAVLink_mission_item_int_message(
        target[0],
        target[1],
        seq,
        item.frame,
        item.command,
        int(current),
        item.autocontinue,
        item.param1,
        item.param2,
        item.param3,
        item.param4,
        item.x,
        item.y,
        item.z,
        mission_type,
    )


def _crc_table() -> tuple[int, ...]:
    table = []
    for value in range(256):
        for _ in range(8):
            value = value >> 1 ^ 0xEDB88320 if value & 1 else value >> 1
        table.append(value)
    return tuple(table)


_CRC_TABLE = _crc_table()


def checksum(item: Item, crc: int) -> int:
    """PX4's mission id, item by item: CRC-32 (start 0, not inverted) over the packed items, NaN as 0x7FC00000."""
    packed = _PACKED.pack(
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
    for byte in packed:
        crc = _CRC_TABLE[(crc ^ byte) & 0xFF] ^ crc >> 8
    return crc
