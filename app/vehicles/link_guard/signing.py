"""MAVLink 2 signatures: made, checked, and held against their timestamps. Pure: keys and clocks come from outside.

Source: https://mavlink.io/en/guide/message_signing.html
"""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from app.vehicles.link_guard.frames import SIGNED_FLAG, SIGNED_FLAG_CHECKSUM, V2

KEY_BYTES: Final = 32
_EPOCH_S: Final = 1_420_070_400
"""2015-01-01 00:00:00 UTC, from where timestamps count."""
TICKS_PER_S: Final = 100_000
_LAST_TICK: Final = (1 << 48) - 1
NEW_STREAM_TICKS: Final = 60 * TICKS_PER_S
"""A stream that is heard for the first time may be so far behind, as in MAVLink's own libraries."""


@dataclass(frozen=True, slots=True)
class SigningKey:
    """A secret of 32 bytes. `fingerprint` names it where the secret itself must not be shown."""

    secret: bytes = field(repr=False)
    fingerprint: str = field(init=False, compare=False, repr=False)
    """The first 8 bytes of the secret's SHA-256, as hex."""

    def __post_init__(self) -> None:
        """Raises ValueError for a secret of another length, or of zeros alone, which means "no signing"."""
        if len(self.secret) != KEY_BYTES or not any(self.secret):
            raise ValueError(f"a signing key has {KEY_BYTES} bytes, not all of them zero")
        object.__setattr__(self, "fingerprint", hashlib.sha256(self.secret).hexdigest()[:16])


class Signature(NamedTuple):
    """What stands before the hash: the sender's link and its clock in units of 10 us since 2015."""

    link_id: int
    timestamp: int


def signature_of(frame: bytes) -> Signature:
    """Of a signed frame, checked or not."""
    return Signature(frame[-13], int.from_bytes(frame[-12:-6], "little"))


def sign(frame: bytes, key: SigningKey, signature: Signature) -> bytes:
    """An unsigned MAVLink 2 frame, signed. The checksum covers the flag, so it changes with it."""
    if frame[0] != V2 or frame[2]:
        raise ValueError("only an unsigned MAVLink 2 frame can be signed")
    signed = bytearray(frame)
    signed[2] = SIGNED_FLAG
    change = SIGNED_FLAG_CHECKSUM[frame[1]]
    signed[-2] ^= change & 0xFF
    signed[-1] ^= change >> 8
    signed.append(signature.link_id)
    signed += signature.timestamp.to_bytes(6, "little")
    return bytes(signed) + _hash(key, signed)


def is_signed_by(frame: bytes, key: SigningKey) -> bool:
    """Whether this key made the signature of a signed frame."""
    return hmac.compare_digest(_hash(key, frame[:-6]), frame[-6:])


def _hash(key: SigningKey, data: bytes | bytearray) -> bytes:
    digest = hashlib.sha256(key.secret)
    digest.update(data)
    return digest.digest()[:6]


def ticks(unix_s: float) -> int:
    """A Unix time as a timestamp."""
    return min(max(round((unix_s - _EPOCH_S) * TICKS_PER_S), 0), _LAST_TICK)


class SigningClock:
    """Gives each frame that is sent a timestamp of its own, later than all before it and than all that were accepted.

    `reserved` is what was stored for the next start: later timestamps need a new reservation first.
    """

    def __init__(self, reserved: int = 0) -> None:
        self.last = self.reserved = reserved

    def next(self, unix_s: float) -> int:
        """The timestamp of the next frame. It must not be sent while it `needs_reservation`."""
        self.last = min(max(ticks(unix_s), self.last + 1), _LAST_TICK)
        return self.last

    def observe(self, timestamp: int) -> None:
        """A timestamp was accepted: the next one sent is later."""
        self.last = max(self.last, timestamp)

    @property
    def needs_reservation(self) -> bool:
        """Whether a crash now could give a timestamp out twice."""
        return self.last > self.reserved

    def reserve(self, until: int) -> None:
        """So far it was stored."""
        self.reserved = max(self.reserved, until)


class SigningClocks:
    """A clock for each key: a vehicle whose timestamps run far ahead takes no other vehicle's clock along."""

    def __init__(self, reserved: Mapping[str, int] | None = None) -> None:
        """`reserved`: what was stored, by the fingerprint of the key."""
        self._stored = dict(reserved or {})
        self._of: dict[SigningKey, SigningClock] = {}

    def of(self, key: SigningKey) -> SigningClock:
        """The clock of what is signed with this key."""
        clock = self._of.get(key)
        if clock is None:
            clock = self._of[key] = SigningClock(self._stored.get(key.fingerprint, 0))
        return clock

    def follow(self, key: SigningKey, former: SigningKey) -> None:
        """A vehicle changes to this key: it refuses timestamps that are behind those of its former one."""
        self.of(key).observe(self.of(former).last)

    def ahead(self, by: int, unix_s: float) -> dict[str, int]:
        """What to store now, by fingerprint, so that so many ticks may pass on each clock before the next time.

        0: the service ends, and nothing more is sent.
        """
        now = ticks(unix_s) if by else 0
        return self._stored | {key.fingerprint: max(clock.last, now) + by for key, clock in self._of.items()}

    def reserve(self, stored: Mapping[str, int]) -> None:
        """This was stored."""
        for key, clock in self._of.items():
            clock.reserve(stored.get(key.fingerprint, 0))


class StreamKey(NamedTuple):
    """Whose timestamps increase. A new key begins new streams: whoever misused the former one has no say in them."""

    fingerprint: str
    system: int
    component: int
    link_id: int


RECENT_TICKS: Final = 2 * TICKS_PER_S


class StreamTimes:
    """The last accepted timestamp of each stream of signed frames."""

    def __init__(self, last: Mapping[StreamKey, int] | None = None) -> None:
        self._last: dict[StreamKey, int] = dict(last or {})

    def is_new(self, stream: StreamKey, timestamp: int, now: int) -> bool:
        """Whether it is later than all before it; of an unknown stream, whether it is not too far behind `now`."""
        last = self._last.get(stream)
        return timestamp + NEW_STREAM_TICKS >= now if last is None else timestamp > last

    def is_recent(self, stream: StreamKey, timestamp: int) -> bool:
        """Whether it may be what was heard last, come another way; a recording is older."""
        last = self._last.get(stream)
        return last is not None and timestamp + RECENT_TICKS > last

    def accept(self, stream: StreamKey, timestamp: int) -> None:
        """A frame of a known key, with this timestamp, was taken."""
        self._last[stream] = timestamp

    def last(self) -> dict[StreamKey, int]:
        """All of them, to be stored."""
        return dict(self._last)
