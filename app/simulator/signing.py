"""MAVLink 2 signing of a vehicle, as PX4 does it (mavlink_sign_control.cpp) and with pymavlink's signatures.

The key is read at the start, and SETUP_SIGNING sets another one while disarmed. A vehicle has no clock: after a boot
its timestamps begin where the key was given to it, and go on from the first signed frame that it verifies.
"""

from __future__ import annotations

import json
import os
import struct
from dataclasses import dataclass, field
from pathlib import Path

from app.simulator.dialect import Message, mavlink
from app.simulator.wire import Severity

KEY_BYTES = 32
UNSIGNED = frozenset({0, 109, 246, 247})
"""HEARTBEAT, RADIO_STATUS, ADSB_VEHICLE, COLLISION are taken unsigned as well."""
_STORED = struct.Struct(f"<{KEY_BYTES}sQ")
"""PX4's mavlink-signing-key.bin: the key, and the timestamp at which it was given."""


class SigningMavlink(mavlink.MAVLink):  # type: ignore[misc]
    """pymavlink's packer and parser. It notes a timestamp before it knows whether the signature is right: undone here,
    or one forged frame would shut its owner out.
    """

    def check_signature(self, msgbuf: bytearray, srcSystem: int, srcComponent: int) -> bool:  # noqa: N803 pymavlink's
        """Whether the signature is right, and its timestamp new."""
        stream = (msgbuf[-13], srcSystem, srcComponent)
        known = self.signing.stream_timestamps
        before = known.get(stream)
        if super().check_signature(msgbuf, srcSystem, srcComponent):
            return True
        if before is None:
            known.pop(stream, None)
        else:
            known[stream] = before
        return False


@dataclass(slots=True)
class VehicleSigning:
    """The key of one vehicle and the signatures of its links. `file` is where the key is, "" for none at first."""

    system_id: int
    file: str = ""
    _links: list[Message] = field(default_factory=list)
    _key: bytes | None = None
    _given_at: int = 0

    def __post_init__(self) -> None:
        """Raises OSError, ValueError: the file holds no key for this vehicle."""
        if self.file and os.path.exists(self.file):
            self._key, self._given_at = _read(Path(self.file), self.system_id)

    def link(self) -> Message:
        """What the packers and the parser of the next link share."""
        link = mavlink.MAVLinkSigning()
        link.link_id = len(self._links)
        self._links.append(link)
        self._put_on(link)
        return link

    def boot(self) -> None:
        """Power-up: what was heard is forgotten, time begins where the key was given."""
        for link in self._links:
            self._put_on(link)

    def on_setup(self, message: Message, *, armed: bool) -> tuple[Severity, str]:
        """SETUP_SIGNING, whatever its target, as PX4. Answers with a text."""
        if armed:
            return Severity.CRITICAL, "MAVLink signing: rejected while armed"
        key, given_at = bytes(message.secret_key), int(message.initial_timestamp)
        blank = not any(key) and not given_at
        if blank and self._key is not None and not message.get_signed():
            return Severity.CRITICAL, "MAVLink signing: blank key rejected"
        self._key, self._given_at = (None, 0) if blank else (key, given_at)
        if self.file and not _is_list(Path(self.file)):
            _write(Path(self.file), self._key or bytes(KEY_BYTES), given_at)
        self.boot()
        return Severity.INFO, "MAVLink signing disabled" if blank else "MAVLink signing key accepted"

    def _put_on(self, link: Message) -> None:
        link.secret_key = self._key
        link.sign_outgoing = self._key is not None
        link.timestamp = self._given_at
        link.allow_unsigned_callback = lambda _mavlink, message_id: message_id in UNSIGNED
        link.stream_timestamps.clear()


def _is_list(path: Path) -> bool:
    """Whether it is Waydrop's own list of keys, which a vehicle does not write to."""
    return path.exists() and path.read_bytes()[:1] == b"{"


def _read(path: Path, system_id: int) -> tuple[bytes | None, int]:
    """PX4's key file, 32 bytes alone, or a link-keys.json, of which the vehicle has its oldest key."""
    data = path.read_bytes()
    if data[:1] == b"{":
        own = json.loads(data).get("vehicles", {}).get(str(system_id), [])
        if not own:
            raise ValueError(f"{path} has no key for system {system_id}")
        return bytes.fromhex(own[0]["secret"]), 0
    if len(data) not in (KEY_BYTES, _STORED.size):
        raise ValueError(f"{path} is no key: {len(data)} bytes, not {KEY_BYTES} or {_STORED.size}")
    key, given_at = _STORED.unpack(data.ljust(_STORED.size, b"\0"))
    return (key, given_at) if any(key) else (None, 0)


def _write(path: Path, key: bytes, given_at: int) -> None:
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as file:
        file.write(_STORED.pack(key, given_at))
