"""UDP: a port that vehicles send to (udpin), and a vehicle that waits to be spoken to (udpout).

A peer whose vehicle was admitted gets a socket of its own on the same port, connected to it: its datagrams wait in a
queue of their own, and a flood from elsewhere fills only the queue of everybody else.
"""

from __future__ import annotations

import contextlib
import ipaddress
import socket
import time
from collections.abc import Iterable
from typing import Final

from app.vehicles.link_guard.datagrams import Address, DatagramReader, udp_socket
from app.vehicles.link_guard.options import ConnectionOptions
from app.vehicles.link_guard.outside import Inward
from app.vehicles.link_guard.policy import Peer

_SLOT_S: Final = 0.05
_PER_SLOT: Final = 250
"""Datagrams of strangers in a slot: 5,000 a second."""
_PER_SLOT_OPEN: Final = 1000
"""The same where everybody may speak, and nobody has a socket of their own."""


class _UdpPeer(Peer):
    __slots__ = ("place", "reader", "sock")

    def __init__(self, place: Address, *, is_allowed: bool) -> None:
        super().__init__(place[0], _name(place), is_allowed=is_allowed)
        self.place = place
        self.sock: socket.socket | None = None
        self.reader: DatagramReader | None = None

    def disconnect(self) -> None:
        """Give its own socket up."""
        if self.reader is not None:
            self.reader.close()
        self.sock = self.reader = None


class UdpListener:
    """udpin."""

    def __init__(self, host: str, port: int, options: ConnectionOptions, inward: Inward) -> None:
        self._place: Address = (host, port)
        self._family = family_of(host)
        self._options = options
        self._inward = inward
        self._peers: dict[Address, _UdpPeer] = {}
        self._sock: socket.socket | None = None
        self._reader: DatagramReader | None = None
        self._per_slot = _PER_SLOT_OPEN if options.any_peer else _PER_SLOT
        self._slot_s, self._in_slot = 0.0, 0

    async def open(self) -> None:
        """See Outside."""
        self._sock = udp_socket(self._family)
        try:
            self._sock.bind(self._place)  # without SO_REUSEADDR: a port that another program has is refused
        except OSError:
            self._sock.close()
            raise
        self._place = self._sock.getsockname()
        self._reader = DatagramReader(self._sock, self._take)

    def send(self, peer: Peer, frame: bytes) -> bool:
        """See Outside."""
        assert isinstance(peer, _UdpPeer)
        try:
            if peer.sock is not None:
                peer.sock.send(frame)
            elif self._sock is not None:
                self._sock.sendto(frame, peer.place)
        except BlockingIOError:
            return False
        except OSError:
            return True  # nobody listens there, or no way leads there: as good as lost on the way
        return True

    def greeted(self) -> Iterable[Peer]:
        """See Outside. Vehicles speak first here."""
        return ()

    def tick(self, now_s: float) -> None:
        """See Outside."""
        for place, peer in list(self._peers.items()):
            if not self._inward.owns(peer):
                peer.disconnect()
                del self._peers[place]

    def close(self) -> None:
        """See Outside."""
        for peer in self._peers.values():
            peer.disconnect()
        self._peers.clear()
        if self._reader is not None:
            self._reader.close()
        self._sock = self._reader = None

    def _take(self, data: bytes, place: Address, late: bool) -> None:
        """A datagram of somebody who has no socket of their own."""
        self._count()
        known = self._peers.get(place)
        peer = known or _UdpPeer(place, is_allowed=self._options.allows(place[0]))
        self._inward.deliver(data, peer, late)
        if known is None and self._inward.owns(peer):  # also by a frame that came too late to pass
            self._peers[place] = peer
            if not self._options.any_peer:
                self._connect(peer)

    def _count(self) -> None:
        """Strangers get their share of the loop's time, and no more."""
        now_s = time.monotonic()
        if now_s - self._slot_s >= _SLOT_S:
            self._slot_s, self._in_slot = now_s, 0
        self._in_slot += 1
        if self._in_slot >= self._per_slot and self._reader is not None:
            self._reader.pause(self._slot_s + _SLOT_S - now_s)

    def _connect(self, peer: _UdpPeer) -> None:
        """A socket of its own. Where the system does not let two have one port, it goes on without."""
        if self._sock is None:
            return
        own = udp_socket(self._family)
        try:
            for sock in (self._sock, own):
                sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            own.bind(self._place)
            own.connect(peer.place)
        except OSError:
            own.close()
            return
        finally:
            for sock in (self._sock, own):
                with contextlib.suppress(OSError):  # nobody else may have the port
                    sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 0)
        peer.sock = own

        def take(data: bytes, place: Address, late: bool) -> None:
            if place == peer.place:
                self._inward.deliver(data, peer, late)
            else:  # it came while the socket was not connected yet
                self._take(data, place, late)

        peer.reader = DatagramReader(own, take)


class UdpClient:
    """udpout: one peer, named by the operator; the kernel drops what comes from elsewhere."""

    def __init__(self, host: str, port: int, inward: Inward) -> None:
        self._peer = _UdpPeer((host, port), is_allowed=True)
        self._family = family_of(host)
        self._inward = inward

    async def open(self) -> None:
        """See Outside."""
        sock = udp_socket(self._family)
        try:
            sock.connect(self._peer.place)
        except OSError:
            sock.close()
            raise
        self._peer.sock = sock
        self._peer.reader = DatagramReader(sock, self._take)

    def send(self, peer: Peer, frame: bytes) -> bool:
        """See Outside."""
        try:
            if self._peer.sock is not None:
                self._peer.sock.send(frame)
        except BlockingIOError:
            return False
        except OSError:
            return True
        return True

    def greeted(self) -> Iterable[Peer]:
        """See Outside."""
        return (self._peer,)

    def tick(self, now_s: float) -> None:
        """See Outside."""

    def close(self) -> None:
        """See Outside."""
        self._peer.disconnect()

    def _take(self, data: bytes, _place: Address, late: bool) -> None:
        self._inward.deliver(data, self._peer, late)


def family_of(host: str) -> int:
    """The address family of a numeric address."""
    return socket.AF_INET6 if ipaddress.ip_address(host).version == 6 else socket.AF_INET


def _name(place: Address) -> str:
    host, port = place[:2]
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
