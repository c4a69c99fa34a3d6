"""The vehicles' side of a guarded connection: what UDP, TCP and serial ports have in common."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from app.domain.vehicle.link_security import RefusalKind
from app.vehicles.link_guard.policy import Peer


class FrameReceiver(Protocol):
    """The guard, as a transport sees it."""

    def deliver(self, data: bytes, peer: Peer, late: bool) -> int:
        """Whole frames from a peer, and whether they are late. How many there were. `flush` follows in this turn."""

    def flush(self) -> None:
        """Hand on what was delivered in this turn of the loop."""

    def refuse(self, kind: RefusalKind, peer: Peer) -> None:
        """Count something that was refused before it was a frame."""

    def owns(self, peer: Peer) -> bool:
        """Whether a vehicle is heard from this peer."""

    def systems_of(self, peer: Peer) -> int:
        """How many vehicles are heard from this peer."""

    def lost(self, peer: Peer) -> None:
        """It is not there any more."""


class LinkTransport(Protocol):
    """Sockets or a device, opened by `open` and ended by `close`. Nothing here waits."""

    async def open(self) -> None:
        """Raises OSError."""

    def send(self, peer: Peer, frame: bytes) -> bool:
        """Send a frame now, or not at all: False if the buffer is full, for what waits comes too late."""

    def awaiting_heartbeat(self) -> Iterable[Peer]:
        """Peers that send nothing before they get a HEARTBEAT."""

    def tick(self, now_s: float) -> None:
        """Let go of what is not needed any more. Called a few times a second."""

    def close(self) -> None:
        """Close everything. Idempotent."""
