"""MAVLink frames as bytes: where one ends, who sent it, whom it is for. Payloads are not read, but for addresses.

Source: https://mavlink.io/en/guide/serialization.html
"""

from __future__ import annotations

import binascii
import re
from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple

V1: Final = 0xFE
V2: Final = 0xFD
SIGNED_FLAG: Final = 0x01
"""MAVLINK_IFLAG_SIGNED, the one incompatibility flag there is."""

HEADER_V1: Final = 6
HEADER_V2: Final = 10
CHECKSUM: Final = 2
SIGNATURE: Final = 13
LONGEST: Final = HEADER_V2 + 255 + CHECKSUM + SIGNATURE

HEARTBEAT: Final = 0
PING: Final = 4
MISSION_ITEM_INT: Final = 73
RADIO_STATUS: Final = 109
STATUSTEXT: Final = 253
SETUP_SIGNING: Final = 256
_CRC_EXTRA: Final = {HEARTBEAT: 50, SETUP_SIGNING: 71}
"""Of the messages that are built here, or believed before anything else is known of their sender."""

MAV_TYPE_GCS: Final = 6


def frame_length(data: bytes, at: int = 0) -> int | None:
    """The length of the frame that begins at `at`; 0 if none begins there, None if more bytes are needed."""
    left = len(data) - at
    if left < 3:
        begins = left <= 0 or data[at] in (V1, V2)
        return None if begins else 0
    if data[at] == V2:
        flags = data[at + 2]
        if flags & ~SIGNED_FLAG:
            return 0  # a frame whose form nobody here knows
        return HEADER_V2 + data[at + 1] + CHECKSUM + (SIGNATURE if flags else 0)
    return HEADER_V1 + data[at + 1] + CHECKSUM if data[at] == V1 else 0


def split(datagram: bytes) -> Iterator[bytes]:
    """The whole frames of a datagram, up to the first bytes that are none."""
    at, end = 0, len(datagram)
    while at < end:
        length = frame_length(datagram, at)
        if not length or at + length > end:
            return
        yield datagram if length == end else datagram[at : at + length]
        at += length


def system_id(frame: bytes) -> int:
    """Who sent it."""
    return frame[5] if frame[0] == V2 else frame[3]


def component_id(frame: bytes) -> int:
    """The sender's component."""
    return frame[6] if frame[0] == V2 else frame[4]


def message_id(frame: bytes) -> int:
    """Which message it carries."""
    if frame[0] == V2:
        return frame[7] | frame[8] << 8 | frame[9] << 16
    return frame[5]


def is_signed(frame: bytes) -> bool:
    """Whether it carries a signature; nothing is said of what that is worth."""
    return frame[0] == V2 and frame[2] == SIGNED_FLAG


def payload(frame: bytes) -> bytes:
    """Its payload, without the zeros that MAVLink 2 cuts off at the end."""
    header = HEADER_V2 if frame[0] == V2 else HEADER_V1
    return frame[header : header + frame[1]]


# The checksum: CRC-16/MCRF4XX over all but the first byte, then over a byte that stands for the message's definition.
#
# binascii has its mirror image (CCITT, most significant bit first), so bits are turned round on the way in and out.


_MIRRORED: Final = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))


def _mirror16(value: int) -> int:
    return _MIRRORED[value & 0xFF] << 8 | _MIRRORED[value >> 8]


def checksum(data: bytes, start: int = 0xFFFF) -> int:
    """CRC-16/MCRF4XX of `data`, going on from `start`."""
    return _mirror16(binascii.crc_hqx(data.translate(_MIRRORED), _mirror16(start)))


_OF_ONE_BYTE: Final = frozenset(checksum(bytes([byte]), 0) for byte in range(256))


def _body_end(frame: bytes) -> int:
    return (HEADER_V2 if frame[0] == V2 else HEADER_V1) + frame[1]


def is_intact(frame: bytes) -> bool:
    """Whether its checksum fits what it carries, by any message definition: one damaged frame of 256 passes for whole.

    Where the definition is known here, it must fit that one.
    """
    end = _body_end(frame)
    received = frame[end] | frame[end + 1] << 8
    body = checksum(frame[1:end])
    extra = _CRC_EXTRA.get(message_id(frame))
    if extra is not None:
        return checksum(bytes([extra]), body) == received
    return received ^ body >> 8 in _OF_ONE_BYTE


SIGNED_FLAG_CHECKSUM: Final = tuple(checksum(b"\x01" + bytes(8 + length), 0) for length in range(256))
"""What the signed flag changes in a checksum, by the length of the payload: a CRC is linear, so whoever sets the flag
needs to know no message definition, and a frame that was damaged before stays damaged.
"""


def build(message: int, body: bytes, *, sequence: int, system: int, component: int) -> bytes:
    """A MAVLink 2 frame of one of the two messages that the guard sends by itself."""
    header = bytes((V2, len(body), 0, 0, sequence & 0xFF, system, component)) + message.to_bytes(3, "little")
    frame = header + body
    return frame + checksum(bytes([_CRC_EXTRA[message]]), checksum(frame[1:])).to_bytes(2, "little")


def ground_heartbeat(*, sequence: int, system: int, component: int) -> bytes:
    """HEARTBEAT of a ground station: MAV_TYPE_GCS, MAV_AUTOPILOT_INVALID, MAV_STATE_ACTIVE."""
    body = bytes((0, 0, 0, 0, MAV_TYPE_GCS, 8, 0, 4, 3))
    return build(HEARTBEAT, body, sequence=sequence, system=system, component=component)


def setup_signing(target: int, secret: bytes, timestamp: int, *, sequence: int, system: int, component: int) -> bytes:
    """SETUP_SIGNING to the autopilot of `target`. It carries the key in the clear."""
    body = timestamp.to_bytes(8, "little") + bytes((target, 1)) + secret
    return build(SETUP_SIGNING, body.rstrip(b"\0"), sequence=sequence, system=system, component=component)


_TARGET_AT: Final[Mapping[int, int]] = {
    PING: 12,
    11: 4,  # SET_MODE
    20: 2,  # PARAM_REQUEST_READ
    21: 0,  # PARAM_REQUEST_LIST
    23: 4,  # PARAM_SET
    39: 32,  # MISSION_ITEM
    40: 2,  # MISSION_REQUEST
    41: 2,  # MISSION_SET_CURRENT
    43: 0,  # MISSION_REQUEST_LIST
    44: 2,  # MISSION_COUNT
    45: 0,  # MISSION_CLEAR_ALL
    47: 0,  # MISSION_ACK
    51: 2,  # MISSION_REQUEST_INT
    MISSION_ITEM_INT: 32,
    75: 30,  # COMMAND_INT
    76: 30,  # COMMAND_LONG
    82: 36,  # SET_ATTITUDE_TARGET
    84: 50,  # SET_POSITION_TARGET_LOCAL_NED
    86: 50,  # SET_POSITION_TARGET_GLOBAL_INT
    110: 1,  # FILE_TRANSFER_PROTOCOL
    SETUP_SIGNING: 8,
}
"""Of the messages that Waydrop and mavsdk send; a test holds them against MAVLink's definitions."""


def target_system(frame: bytes) -> int:
    """The system that it is for; 0: for all of them."""
    at = _TARGET_AT.get(message_id(frame))
    if at is None or at >= frame[1]:
        return 0
    return frame[(HEADER_V2 if frame[0] == V2 else HEADER_V1) + at]


class SentItem(NamedTuple):
    """Which item of which list a MISSION_ITEM_INT carries, and to which system."""

    system: int
    mission_type: int
    seq: int


def sent_item(frame: bytes) -> SentItem | None:
    """What a frame of mavsdk's carries, if it is a MISSION_ITEM_INT."""
    if message_id(frame) != MISSION_ITEM_INT or frame[0] != V2 or frame[1] <= 32:
        return None
    mission_type = frame[HEADER_V2 + 37] if frame[1] > 37 else 0
    return SentItem(frame[HEADER_V2 + 32], mission_type, frame[HEADER_V2 + 28] | frame[HEADER_V2 + 29] << 8)


_BEGINNING: Final = re.compile(b"[\xfd\xfe]")
"""V2 and V1, the bytes that may begin a frame."""


class FrameStream:
    """Finds the frames in a stream of bytes. Damaged ones are left out, and the search goes on a byte later."""

    def __init__(self) -> None:
        self._waiting = b""
        self.skipped = 0
        """Bytes that belong to no whole frame, so far."""
        self.damaged = 0
        """Bytes that could have begun a frame and did not, so far: each costs a look, or a checksum."""

    def feed(self, data: bytes) -> list[bytes]:
        """The frames that are whole now. Keeps less than one frame for the next call."""
        data = self._waiting + data if self._waiting else data
        at, end, found = 0, len(data), []
        while at < end:
            length = frame_length(data, at)
            if length is None or (length and at + length > end):
                break
            frame = data[at : at + length]
            if length and is_intact(frame):
                found.append(frame)
                at += length
                continue
            self.damaged += 1
            beginning = _BEGINNING.search(data, at + 1)
            after = end if beginning is None else beginning.start()
            self.skipped += after - at
            at = after
        self._waiting = data[at:]
        return found
