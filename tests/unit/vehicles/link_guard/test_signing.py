"""Signatures are those of pymavlink, byte for byte; timestamps never come twice."""

from __future__ import annotations

import json
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.vehicles.link_guard import frames
from app.vehicles.link_guard.signing import (
    NEW_STREAM_TICKS,
    Signature,
    SigningClock,
    SigningKey,
    StreamKey,
    StreamTimes,
    is_signed_by,
    sign,
    signature_of,
    ticks,
)
from tests.support.mavlink_frames import FrameSender, timestamp_of
from tests.support.paths import ROOT

VECTORS = json.loads((ROOT / "tests/data/signing/frames.json").read_text(encoding="utf-8"))
KEY = SigningKey(b"k" * 32)
STREAM = StreamKey("abc", 1, 1, 0)


@pytest.mark.parametrize("vector", VECTORS, ids=lambda vector: str(vector["message"]))
def test_a_signed_frame_is_the_one_of_pymavlink(vector: dict[str, object]) -> None:
    key = SigningKey(bytes.fromhex(str(vector["key"])))
    unsigned, signed = (bytes.fromhex(str(vector[name])) for name in ("unsigned", "signed"))
    signature = Signature(int(str(vector["link_id"])), int(str(vector["timestamp"])))
    assert sign(unsigned, key, signature) == signed
    assert is_signed_by(signed, key)
    assert signature_of(signed) == signature
    assert frames.is_intact(signed)


@given(st.integers(0, 10_000), st.integers(0, 7))
def test_a_frame_altered_anywhere_is_not_signed_by_the_key(place: int, bit: int) -> None:
    signed = bytearray(sign(FrameSender().position(), KEY, Signature(1, 2)))
    signed[place % len(signed)] ^= 1 << bit
    assert not is_signed_by(bytes(signed), KEY)


def test_another_key_signs_otherwise() -> None:
    assert not is_signed_by(sign(FrameSender().position(), KEY, Signature(1, 2)), SigningKey(b"l" * 32))


def test_only_an_unsigned_frame_of_mavlink_2_can_be_signed() -> None:
    for frame in (FrameSender().heartbeat(mavlink1=True), FrameSender(key=b"k" * 32).heartbeat()):
        with pytest.raises(ValueError, match="unsigned MAVLink 2"):
            sign(frame, KEY, Signature(0, 1))


@pytest.mark.parametrize("secret", [b"", b"k" * 31, b"k" * 33, bytes(32)], ids=len)
def test_what_is_no_key_is_refused(secret: bytes) -> None:
    with pytest.raises(ValueError, match="32 bytes"):
        SigningKey(secret)


def test_a_key_is_never_shown() -> None:
    assert "6b6b" not in repr(KEY)
    assert "kkk" not in repr(KEY)
    assert KEY.fingerprint not in repr(KEY)
    assert len(KEY.fingerprint) == 16


def test_timestamps_count_ten_microseconds_since_2015() -> None:
    assert ticks(1_420_070_400.0) == 0
    assert ticks(1_420_070_401.0) == 100_000
    assert ticks(0.0) == 0
    now_s = time.time()
    assert ticks(now_s) == timestamp_of(now_s)


@given(st.lists(st.floats(1.4e9, 2.5e9), min_size=1, max_size=50), st.integers(0, 1 << 47))
def test_no_timestamp_comes_twice_wherever_the_machines_clock_jumps(times: list[float], reserved: int) -> None:
    clock = SigningClock(reserved)
    given_out = [clock.next(unix_s) for unix_s in times]
    assert given_out == sorted(set(given_out))
    assert given_out[0] > reserved


def test_a_timestamp_that_was_heard_is_behind_the_next_one() -> None:
    clock = SigningClock()
    clock.observe(1 << 47)
    assert clock.next(time.time()) == (1 << 47) + 1


def test_after_a_crash_the_clock_goes_on_behind_all_that_were_sent() -> None:
    clock = SigningClock()
    sent = [clock.next(1.8e9)]
    assert clock.needs_reservation
    stored = clock.last + 1000
    clock.reserve(stored)
    while not clock.needs_reservation:
        sent.append(clock.next(1.8e9))
    assert len(sent) > 1000
    assert SigningClock(stored).next(0.0) > max(sent[:-1])


def test_a_stream_goes_on_later_and_later() -> None:
    times = StreamTimes()
    now = ticks(1.8e9)
    assert times.is_new(STREAM, now, now)
    times.accept(STREAM, now)
    assert not times.is_new(STREAM, now, now)
    assert not times.is_new(STREAM, now - 1, now)
    assert times.is_new(STREAM, now + 1, now)
    assert times.is_new(STREAM._replace(link_id=1), now - 1, now), "another link of it is another stream"


def test_a_stream_that_is_new_may_be_a_minute_behind_and_no_more() -> None:
    times, now = StreamTimes(), ticks(1.8e9)
    assert times.is_new(STREAM, now - NEW_STREAM_TICKS, now)
    assert not times.is_new(STREAM, now - NEW_STREAM_TICKS - 1, now)
    assert times.is_new(STREAM, now + 10 * NEW_STREAM_TICKS, now)


def test_what_a_stream_had_said_counts_after_a_restart() -> None:
    times, now = StreamTimes(), ticks(1.8e9)
    times.accept(STREAM, now)
    again = StreamTimes(times.last())
    assert not again.is_new(STREAM, now, now)
    assert again.is_new(STREAM, now + 1, now)
