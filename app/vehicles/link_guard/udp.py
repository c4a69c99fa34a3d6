"""UDP: a port that vehicles send to (udpin), and a vehicle that waits to be spoken to (udpout).

A peer whose vehicle was admitted gets a socket of its own on the same port, connected to it: its datagrams wait in a
queue of their own, and a flood from elsewhere fills only the queue of everybody else.
"""

from __future__ import annotations

import contextlib
import ipaddress
import socket
import time
from collections.abc import Callable, Iterable
from functools import partial
from typing import Final

from app.domain.vehicle.link_security import RefusalKind
from app.vehicles.link_guard.datagrams import Address, DatagramReader, udp_socket
from app.vehicles.link_guard.options import ConnectionOptions
from app.vehicles.link_guard.policy import Peer
from app.vehicles.link_guard.rate_budget import UNKNOWN_PEERS_PER_S, RateBudget, RateBudgets
from app.vehicles.link_guard.transport import FrameReceiver

_OPEN_PEERS_PER_S: Final = 40_000.0
"""Where everybody may speak, nobody has a socket of their own."""
_SKIPPED: Final = 0.5
"""Units of a budget that a datagram costs which is skipped."""
_LONGEST: Final = 2048
"""Bytes of a datagram. A network carries 1,500 in one piece, so a vehicle's are shorter."""


class _UdpPeer(Peer):
    __slots__ = ("budget", "place", "reader", "sock")

    def __init__(self, place: Address, budget: RateBudget, *, is_allowed: bool) -> None:
        super().__init__(place[0], place_name(place), is_allowed=is_allowed)
        self.place = place
        self.sock: socket.socket | None = None
        self.reader: DatagramReader | None = None
        self.budget = budget

    def spend(self, units: int) -> None:
        """Count what was read of its own socket, and let the rest wait if that is too much."""
        pause_s = self.budget.spend(units, time.monotonic())
        if pause_s and self.reader is not None:
            self.reader.pause(pause_s)

    def disconnect(self) -> None:
        """Give its own socket up."""
        if self.reader is not None:
            self.reader.close()
        self.sock = self.reader = None


class UdpListener:
    """udpin, a LinkTransport."""

    def __init__(self, host: str, port: int, options: ConnectionOptions, receiver: FrameReceiver) -> None:
        self._place: Address = (host, port)
        self._family = family_of(host)
        self._options = options
        self._receiver = receiver
        self._peers: dict[Address, _UdpPeer] = {}
        self._sock: socket.socket | None = None
        self._reader: DatagramReader | None = None
        self._budgets = RateBudgets(_OPEN_PEERS_PER_S if options.any_peer else UNKNOWN_PEERS_PER_S)

    async def open(self) -> None:
        self._sock = udp_socket(self._family)
        try:
            self._sock.bind(self._place)  # without SO_REUSEADDR: a port that another program has is refused
        except OSError:
            self._sock.close()
            raise
        self._place = self._sock.getsockname()
        self._reader = DatagramReader(self._sock, self._take, self._receiver.flush, self._skip)

    def send(self, peer: Peer, frame: bytes) -> bool:
        assert isinstance(peer, _UdpPeer)
        if peer.sock is not None:
            return _sent(peer.sock.send, frame)
        return self._sock is None or _sent(self._sock.sendto, frame, peer.place)

    def awaiting_heartbeat(self) -> Iterable[Peer]:
        """See LinkTransport. Vehicles speak first here."""
        return ()

    def tick(self, now_s: float) -> None:
        for place, peer in list(self._peers.items()):
            if not self._receiver.owns(peer):
                peer.disconnect()
                del self._peers[place]
            peer.budget.widen(self._receiver.systems_of(peer))

    def close(self) -> None:
        for peer in self._peers.values():
            peer.disconnect()
        self._peers.clear()
        if self._reader is not None:
            self._reader.close()
        self._sock = self._reader = None

    def _take(self, data: bytes, place: Address, late: bool) -> None:
        """A datagram of somebody who has no socket of their own."""
        known = self._peers.get(place)
        peer = known or _UdpPeer(place, self._budgets.of_vehicle(), is_allowed=self._options.allows(place[0]))
        pause_s = self._budgets.unknown_peers.spend(self._deliver(data, peer, late), time.monotonic())
        if pause_s and self._reader is not None:
            self._reader.pause(pause_s)
        if known is None and self._receiver.owns(peer):  # also by a frame that came too late to pass
            self._peers[place] = peer
            if not self._options.any_peer:
                self._connect(peer)

    def _skip(self, place: Address) -> None:
        """One of theirs that is dropped unread."""
        peer = self._peers.get(place) or Peer(place[0], place_name(place), is_allowed=False)
        self._receiver.refuse(RefusalKind.LATE, peer)
        self._budgets.unknown_peers.spend(_SKIPPED, time.monotonic())

    def _deliver(self, data: bytes, peer: Peer, late: bool) -> int:
        """What it cost, in the units of a budget."""
        if len(data) <= _LONGEST:
            return 1 + self._receiver.deliver(data, peer, late)
        self._receiver.refuse(RefusalKind.DAMAGED, peer)
        return 1

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
                peer.spend(self._deliver(data, peer, late))
            else:  # it came while the socket was not connected yet
                self._take(data, place, late)

        peer.reader = DatagramReader(own, take, self._receiver.flush, partial(_skip, self._receiver, peer))


class UdpClient:
    """udpout, a LinkTransport: one peer, named by the operator; the kernel drops what comes from elsewhere."""

    def __init__(self, host: str, port: int, receiver: FrameReceiver) -> None:
        self._peer = _UdpPeer((host, port), RateBudgets().of_vehicle(), is_allowed=True)
        self._family = family_of(host)
        self._receiver = receiver

    async def open(self) -> None:
        sock = udp_socket(self._family)
        try:
            sock.connect(self._peer.place)
        except OSError:
            sock.close()
            raise
        self._peer.sock = sock
        skip = partial(_skip, self._receiver, self._peer)
        self._peer.reader = DatagramReader(sock, self._take, self._receiver.flush, skip)

    def send(self, peer: Peer, frame: bytes) -> bool:
        return self._peer.sock is None or _sent(self._peer.sock.send, frame)

    def awaiting_heartbeat(self) -> Iterable[Peer]:
        return (self._peer,)

    def tick(self, now_s: float) -> None:
        self._peer.budget.widen(self._receiver.systems_of(self._peer))

    def close(self) -> None:
        self._peer.disconnect()

    def _take(self, data: bytes, _place: Address, late: bool) -> None:
        self._peer.spend(1 + self._receiver.deliver(data, self._peer, late))


def _skip(receiver: FrameReceiver, peer: _UdpPeer, _place: Address) -> None:
    """A datagram of its own socket is dropped unread. What that costs delays what it reads next, not this turn."""
    receiver.refuse(RefusalKind.LATE, peer)
    peer.budget.spend(_SKIPPED, time.monotonic())


def _sent(send: Callable[..., int], *what: object) -> bool:
    for _ in range(2):
        try:
            send(*what)
        except BlockingIOError:
            return False
        except ConnectionRefusedError:
            continue  # an ICMP answer to what was sent before: this was not sent yet
        except OSError:
            return True  # no way leads there: as good as lost on the way
        return True
    return True  # nobody listens there


def family_of(host: str) -> int:
    """The address family of a numeric address."""
    return socket.AF_INET6 if ipaddress.ip_address(host).version == 6 else socket.AF_INET


def place_name(place: Address) -> str:
    """What a peer there is called."""
    host, port = place[:2]
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
