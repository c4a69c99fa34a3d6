"""Frames are found, whole, in datagrams and in streams with noise; nobody's payload has to be understood for that."""

from __future__ import annotations

import inspect
import random
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common

from app.vehicles.link_guard import frames
from app.vehicles.link_guard.frames import FrameStream, is_intact, split
from tests.support.mavlink_frames import FrameSender

VEHICLE = FrameSender(7, 3)
FRAMES = [VEHICLE.heartbeat(), VEHICLE.position(), VEHICLE.text("hello"), VEHICLE.heartbeat(mavlink1=True)]


def test_a_frame_tells_who_sent_which_message() -> None:
    for frame in (VEHICLE.position(), VEHICLE.heartbeat(mavlink1=True)):
        assert frames.system_id(frame) == 7
        assert frames.component_id(frame) == 3
    assert frames.message_id(VEHICLE.position()) == 33
    assert frames.message_id(VEHICLE.heartbeat(mavlink1=True)) == 0


def test_a_datagram_of_several_frames_is_split_into_them() -> None:
    assert list(split(b"".join(FRAMES))) == FRAMES


def test_what_follows_the_last_whole_frame_of_a_datagram_is_left_out() -> None:
    assert list(split(FRAMES[0] + FRAMES[1][:-1])) == [FRAMES[0]]
    assert list(split(b"rubbish" + FRAMES[0])) == []


def test_a_frame_with_a_flag_that_nobody_knows_is_no_frame() -> None:
    odd = bytearray(FRAMES[1])
    odd[2] = 0x02
    assert list(split(bytes(odd))) == []


def test_the_checksum_is_that_of_mavlink() -> None:
    assert frames.checksum(b"123456789") == 0x6F91  # CRC-16/MCRF4XX of its catalogue


def test_whole_frames_of_every_message_are_taken_for_whole() -> None:
    speaker = common.MAVLink(None, srcSystem=1, srcComponent=1)
    for kind in (common.MAVLink_attitude_message, common.MAVLink_vfr_hud_message, common.MAVLink_param_value_message):
        fields = [b"A" if "char" in field else 1 for field in kind.fieldtypes]
        assert is_intact(bytes(kind(*fields).pack(speaker)))


@pytest.mark.parametrize("frame", FRAMES, ids=["heartbeat", "position", "text", "mavlink 1"])
def test_of_damaged_frames_hardly_any_is_taken_for_whole(frame: bytes) -> None:
    rng = random.Random(1)
    passed = 0
    for _ in range(2000):
        damaged = bytearray(frame)
        damaged[rng.randrange(6, len(frame))] ^= rng.randrange(1, 256)
        passed += is_intact(bytes(damaged))
    assert passed < 2000 * 3 / 256


def test_a_damaged_heartbeat_never_passes_because_its_definition_is_known() -> None:
    for at in (*range(3, 7), *range(10, len(FRAMES[0]))):  # its length and the number of its message stay
        for bit in range(8):
            damaged = bytearray(FRAMES[0])
            damaged[at] ^= 1 << bit
            assert not is_intact(bytes(damaged))


@given(st.lists(st.sampled_from(FRAMES), max_size=12), st.randoms(use_true_random=False))
def test_a_stream_cut_anywhere_gives_all_its_frames_once_and_in_order(sent: list[bytes], rng: random.Random) -> None:
    stream, data, got = FrameStream(), b"".join(sent), []
    while data:
        size = rng.randrange(1, 40)
        got += stream.feed(data[:size])
        data = data[size:]
    assert got == sent
    assert stream.skipped == 0


@given(st.binary(max_size=300), st.lists(st.sampled_from(FRAMES), min_size=8, max_size=8))
def test_after_noise_a_stream_finds_the_frames_again(noise: bytes, sent: list[bytes]) -> None:
    stream = FrameStream()
    # the noise may begin what looks like a long frame: its length must come before that shows
    got = stream.feed(noise + b"".join(sent) + b"\x00" * frames.LONGEST)
    assert [frame for frame in got if frame in FRAMES][-len(sent) :] == sent


def test_a_stream_of_nothing_but_noise_keeps_less_than_one_frame() -> None:
    stream = FrameStream()
    for _ in range(200):
        stream.feed(bytes([frames.V2]) * 1000)
    assert stream.skipped > 200_000 - 2 * frames.LONGEST


def test_a_heartbeat_of_ours_is_the_one_pymavlink_makes() -> None:
    speaker = common.MAVLink(None, srcSystem=245, srcComponent=190)
    speaker.seq = 9
    made = bytes(common.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(speaker))
    assert frames.ground_heartbeat(sequence=9, system=245, component=190) == made


@pytest.mark.parametrize("secret", [bytes(range(32)), b"k" * 31 + b"\0", b"\1" + bytes(31)], ids=str)
def test_setup_signing_is_the_one_pymavlink_makes(secret: bytes) -> None:
    speaker = common.MAVLink(None, srcSystem=245, srcComponent=190)
    made = bytes(common.MAVLink_setup_signing_message(3, 1, list(secret), 123456789).pack(speaker))
    assert frames.setup_signing(3, secret, 123456789, sequence=0, system=245, component=190) == made


@pytest.mark.parametrize(("seq", "mission_type"), [(0, 0), (3, 0), (700, 1), (65_535, 2)])
def test_of_a_mission_item_its_system_list_and_number_are_read(seq: int, mission_type: int) -> None:
    speaker = common.MAVLink(None, srcSystem=245, srcComponent=190)
    body = (7, 1, seq, 3, 16, 0, 1, 0.0, 0.0, 0.0, 0.0, 473977420, 85455940, 0.0, mission_type)
    frame = bytes(common.MAVLink_mission_item_int_message(*body).pack(speaker))
    assert frames.sent_item(frame) == (7, mission_type, seq)


def test_no_other_frame_is_taken_for_a_mission_item() -> None:
    assert [frames.sent_item(frame) for frame in FRAMES] == [None] * len(FRAMES)


def _target_at(kind: type[common.MAVLink_message]) -> int:
    """Where target_system stands, by trying each byte of an otherwise empty payload."""
    size = struct.calcsize(kind.unpacker.format)
    for at in range(size):
        body = bytearray(size)
        body[at] = 77
        message = common.MAVLink(None).decode(_framed(kind, bytes(body)))
        if message.target_system == 77:
            return at
    raise AssertionError(kind)


def _framed(kind: type[common.MAVLink_message], body: bytes) -> bytearray:
    header = bytes((0xFD, len(body), 0, 0, 0, 1, 1)) + kind.id.to_bytes(3, "little")
    told = frames.checksum(bytes([kind.crc_extra]), frames.checksum((header + body)[1:]))
    return bytearray(header + body + told.to_bytes(2, "little"))


TARGETED = [
    kind
    for _, kind in inspect.getmembers(common, inspect.isclass)
    if getattr(kind, "id", -1) >= 0 and "target_system" in getattr(kind, "fieldnames", ())
]


def test_the_target_is_read_where_mavlink_has_it() -> None:
    known = 0
    for kind in TARGETED:
        body = bytearray(struct.calcsize(kind.unpacker.format))
        body[_target_at(kind)] = 9
        target = frames.target_system(bytes(_framed(kind, bytes(body))))
        assert target in (0, 9), f"{kind.__name__} goes to the wrong system"
        known += target == 9
    assert known >= 20


def test_a_target_that_mavlink_cut_off_as_zero_is_everybody() -> None:
    speaker = common.MAVLink(None, srcSystem=245, srcComponent=190)
    broadcast = bytes(common.MAVLink_command_long_message(0, 0, 511, 0, 0, 0, 0, 0, 0, 0, 0).pack(speaker))
    assert frames.target_system(broadcast) == 0
    assert frames.target_system(FRAMES[1]) == 0
