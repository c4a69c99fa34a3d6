"""A connection's policy under test, its time, and who speaks on it."""

from __future__ import annotations

from dataclasses import dataclass, field

from app.domain.vehicle.link_security import RefusalKind
from app.vehicles.link_guard.keyring import KeyRing, StoredKey
from app.vehicles.link_guard.options import ConnectionOptions, parse_connection
from app.vehicles.link_guard.policy import (
    LinkPolicy,
    Peer,
    Signing,
)
from app.vehicles.link_guard.signing import SigningClocks, SigningKey, StreamTimes
from tests.support.mavlink_frames import FrameSender, timestamp_of

UNIX_S = 1.8e9
SECRET, OTHER_SECRET = b"k" * 32, b"o" * 32
VEHICLE = Peer("10.0.0.2", "10.0.0.2:14580", is_allowed=True)
SAME_HOST = Peer("10.0.0.2", "10.0.0.2:40000", is_allowed=True)
FORGER = Peer("10.0.0.66", "10.0.0.66:5000", is_allowed=True)


@dataclass
class Link:
    """A connection under test, and its time."""

    policy: LinkPolicy
    signing: Signing
    now_s: float = 100.0
    heard: list[RefusalKind | None] = field(default_factory=list)

    def takes(self, frame: bytes, peer: Peer = VEHICLE, *, after_s: float = 0.0) -> RefusalKind | None:
        self.now_s += after_s
        verdict = self.policy.admit(frame, peer, self.now_s, UNIX_S + self.now_s)
        self.heard.append(verdict)
        return verdict

    def peers_of(self, frame: bytes) -> list[Peer]:
        return [route.peer for route in self.policy.routes(frame)]


def link(query: str = "", keys: dict[int, list[StoredKey]] | None = None, used: dict[int, str] | None = None) -> Link:
    options: ConnectionOptions = parse_connection(f"udpin://0.0.0.0:14540{query}").options
    signing = Signing(KeyRing(keys or {}, used), SigningClocks(), StreamTimes())
    return Link(LinkPolicy(options, signing), signing)


def signer(
    secret: bytes = SECRET, *, system: int = 1, component: int = 1, link_id: int = 0, ahead_s: float = 0.0
) -> FrameSender:
    return FrameSender(system, component, key=secret, link_id=link_id, timestamp=timestamp_of(UNIX_S + 100.0 + ahead_s))


IN_USE = {1: [StoredKey(SigningKey(SECRET), in_use=True)]}
NEW = {1: [StoredKey(SigningKey(SECRET))]}
TO_ONE = FrameSender(245, 190)
