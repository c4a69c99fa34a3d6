"""One mission item as the autopilot keeps it."""

from __future__ import annotations

import math
import struct
import zlib
from dataclasses import dataclass
from operator import attrgetter

from app.simulator.airframe import Airframe
from app.simulator.dialect import Message, mavlink
from app.simulator.firmware import FirmwareProfile
from app.simulator.wire import Cmd, MissionAck, MissionType

_PACKED = struct.Struct("<BHB4fiif")
_VALUES = attrgetter("param1", "param2", "param3", "param4", "x", "y", "z")
_ALL_ONES = 0xFFFFFFFF

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
    numbers = int(message.command), int(message.frame), int(message.autocontinue)
    return Item(*numbers, message.param1, message.param2, message.param3, message.param4, x, y, message.z)


def to_message(item: Item, seq: int, current: bool, target: tuple[int, int], mission_type: int) -> Message:
    """MISSION_ITEM_INT for a download."""
    return mavlink.MAVLink_mission_item_int_message(
        *target, seq, item.frame, item.command, int(current), item.autocontinue, *_VALUES(item), mission_type
    )


def checksum(item: Item, crc: int) -> int:
    """PX4's mission id, item by item: CRC-32 (start 0, not inverted) over the packed items, NaN as 0x7FC00000."""
    packed = _PACKED.pack(item.frame, item.command, item.autocontinue, *_VALUES(item))
    return zlib.crc32(packed, crc ^ _ALL_ONES) ^ _ALL_ONES


GLOBAL_FRAMES = frozenset({0, 3, 5, 6})
MISSION_FRAME = 2

GLOBAL_COMMANDS = frozenset({16, 17, 19, 21, 22, 31, 80, 201, 84, 85, 195, 212, 400, 4501})
MISSION_FRAME_COMMANDS = frozenset(
    {20, 80, 93, 112, 177, 178, 179, 187, 189, 196, 197, 200, 201, 203, 204, 205, 206, 211, 212, 214, 260, 400, 530}
    | {532, 534, 1000, 1001, 2000, 2001, 2003, 2500, 2501, 3000, 42600}
)
PAYLOAD_COMMANDS = frozenset({Cmd.DO_GRIPPER, Cmd.DO_WINCH})
FENCE_COMMANDS = frozenset({5000, 5001, 5002, 5003, 5004})
RALLY_COMMANDS = frozenset({5100})

UNUSED_PARAMS: dict[int, tuple[int, ...]] = {
    Cmd.NAV_WAYPOINT: (3,),
    Cmd.NAV_TAKEOFF: (2, 3),
    Cmd.NAV_LAND: (3,),
    Cmd.DO_GRIPPER: (3, 4, 5, 6, 7),
    Cmd.DO_WINCH: (5, 6, 7),
    Cmd.NAV_RETURN_TO_LAUNCH: (1, 2, 3, 4, 5, 6, 7),
}
"""Parameters that a command does not use: NaN or 0, or the item is refused with INVALID_PARAMn (v1.18)."""

UNUSED_IN_ROVER_TAKEOFF = (1, 2, 3)
"""A rover has no pitch to take off with."""


def refusal(item: Item, mission_type: int, profile: FirmwareProfile, airframe: Airframe) -> MissionAck:
    """ACCEPTED, or why the item is refused at once."""
    if mission_type == MissionType.FENCE:
        return _listed(item, FENCE_COMMANDS)
    if mission_type == MissionType.RALLY:
        return _listed(item, RALLY_COMMANDS)
    if item.command in FENCE_COMMANDS:
        return MissionAck.ERROR  # [05_fence_rally]
    if item.command in PAYLOAD_COMMANDS and not profile.delivers_payload:
        return MissionAck.UNSUPPORTED
    if item.frame in GLOBAL_FRAMES:
        if item.command not in GLOBAL_COMMANDS:
            return _misplaced_command(item, profile, airframe)
    elif item.frame == MISSION_FRAME:
        if item.command not in MISSION_FRAME_COMMANDS:
            return MissionAck.UNSUPPORTED
    else:
        return MissionAck.UNSUPPORTED_FRAME
    return _mask_refusal(item, airframe) if profile.unused_params_must_be_empty else MissionAck.ACCEPTED


def _listed(item: Item, commands: frozenset[int]) -> MissionAck:
    """Fence and rally plans also take a waypoint at this stage [05_fence_rally]."""
    if item.command in commands or item.command == Cmd.NAV_WAYPOINT:
        return MissionAck.ACCEPTED
    return MissionAck.UNSUPPORTED


def _misplaced_command(item: Item, profile: FirmwareProfile, airframe: Airframe) -> MissionAck:
    """A command without position in a global frame: the mask check comes first and finds its coordinates."""
    if profile.unused_params_must_be_empty and item.command in MISSION_FRAME_COMMANDS:
        mask = _mask_refusal(item, airframe)
        return mask if mask != MissionAck.ACCEPTED else MissionAck.INVALID_PARAM5_X
    return MissionAck.UNSUPPORTED


def _mask_refusal(item: Item, airframe: Airframe) -> MissionAck:
    values = (item.param1, item.param2, item.param3, item.param4, float(item.x), float(item.y), item.z)
    unused = UNUSED_PARAMS.get(item.command, ())
    if item.command == Cmd.NAV_TAKEOFF and airframe.is_rover:
        unused = UNUSED_IN_ROVER_TAKEOFF
    for number in unused:
        value = values[number - 1]
        if not math.isnan(value) and value != 0.0:
            return MissionAck(MissionAck.INVALID_PARAM1 + number - 1)
    return MissionAck.ACCEPTED
