"""One guarded connection: frames from its vehicles' side are judged and handed to mavsdk, mavsdk's are signed and sent.

mavsdk listens on a port of 127.0.0.1 that the kernel chose, and knows no other peer: processes of this machine are
trusted. All of it runs on the event loop: while that stands still nothing passes, and what waited too long never does.
"""

from __future__ import annotations

import asyncio
import errno
import socket
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Final

from app.domain.errors import ConflictError, LinkError, LinkTimeoutError, NotFoundError
from app.domain.vehicle.link_security import LinkSecurity, RefusalKind, Refused, Relayed
from app.vehicles.link_guard import frames
from app.vehicles.link_guard.datagrams import Address, DatagramReader, udp_socket
from app.vehicles.link_guard.memory import SigningStore
from app.vehicles.link_guard.options import Connection
from app.vehicles.link_guard.policy import LinkPolicy, Peer, Route
from app.vehicles.link_guard.serial import SerialPort
from app.vehicles.link_guard.signing import Signature, sign
from app.vehicles.link_guard.tcp import TcpClient, TcpListener
from app.vehicles.link_guard.transport import FrameReceiver, LinkTransport
from app.vehicles.link_guard.udp import UdpClient, UdpListener
from app.vehicles.settings import OWN_SYSTEM_ID

LOOPBACK: Final = "127.0.0.1"
OUR_COMPONENT_ID: Final = 190

_HEARTBEAT_PERIOD_S: Final = 1.0
_PING_PERIOD_S: Final = 4.0
"""mavsdk sends a PING to everybody every 5 s for each of its systems: with a hundred of them, each would have to answer
twenty a second. One is enough for all.
"""
_SETUP_TRIES: Final = 5
_SETUP_WAIT_S: Final = 1.0
_MAX_LISTED_SYSTEMS: Final = 8

_BUNDLE: Final = 1400
"""Bytes that are handed to mavsdk as one datagram. Many vehicles on one port send at once; each datagram costs two
system calls and two changes of thread.
"""

_AGED: Final = frozenset({frames.HEARTBEAT, 2, 24, 33, 36, 245})
"""HEARTBEAT, SYSTEM_TIME, GPS_RAW_INT, GLOBAL_POSITION_INT, SERVO_OUTPUT_RAW, EXTENDED_SYS_STATE: these count as of now
when they arrive, so none is let in late. Answers and reports are: nobody sends them again.
"""


ItemWatcher = Callable[[int, int], None]
"""Gets the MAV_MISSION_TYPE and the number of a mission item that was sent."""
WatchItems = Callable[[ItemWatcher], Callable[[], None]]
"""Watch one vehicle's, until the returned function is called."""


class _Tally:
    """What was refused for one reason. `systems`: those that it was refused for last."""

    def __init__(self) -> None:
        self.count = 0
        self.peer = ""
        self.systems: dict[int, None] = {}

    def add(self, peer: Peer, system: int | None) -> None:
        self.count += 1
        self.peer = peer.name
        if system is None:
            return
        self.systems.pop(system, None)
        self.systems[system] = None
        if len(self.systems) > _MAX_LISTED_SYSTEMS:
            del self.systems[next(iter(self.systems))]


_OPEN_HINTS: Final = {
    errno.EADDRINUSE: "another ground station or gateway uses it: end it, or choose another port",
    errno.EBUSY: "another program uses the device: end it",
    errno.EADDRNOTAVAIL: "this machine has no such address: use 0.0.0.0 for all of its own",
    errno.ENOENT: "there is no such device: connect it, or correct its path",
    errno.EACCES: "give the user that runs Waydrop access to it",
}


class LinkGuard:
    """A FrameReceiver, made on the event loop. `open`, then mavsdk on `inner_url`, then `begin`; ended by `close`."""

    def __init__(
        self, connection: Connection, store: SigningStore, link_id: int, own_system_id: int = OWN_SYSTEM_ID
    ) -> None:
        """`link_id` is that of our signatures, if the connection does not say another."""
        self.connection = connection
        self._store = store
        self._sender = {"system": own_system_id, "component": OUR_COMPONENT_ID}
        own_id = connection.options.link_id
        self._link_id = link_id % 256 if own_id is None else own_id
        self._policy = LinkPolicy(connection.options, store.signing)
        self._transport = transport_of(connection, self)
        self._inner: DatagramReader | None = None
        self._inner_socket: socket.socket | None = None
        self._held: socket.socket | None = None
        self._mavsdk: Address = ()
        self._ourselves = Peer(LOOPBACK, "waydrop", is_allowed=True)
        self._tallies: dict[RefusalKind, _Tally] = {}
        self._bundle: list[bytes] = []
        self._from_vehicles = self._to_vehicles = 0
        self._item_watchers: dict[int, ItemWatcher] = {}
        self._sequence = 0
        self._heartbeat_sent_s = self._pinged_s = 0.0

    async def open(self) -> None:
        """Open the vehicles' side, and reserve a port for mavsdk.

        Raises:
            LinkError: it cannot be opened; nothing stays open.
        """
        try:
            self._held = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._held.bind((LOOPBACK, 0))
            # after bind: Linux gives sockets that have it already the same port now and then, so that two connections
            # would hand their vehicles to one mavsdk. It lets mavsdk, which sets it too, have the port beside this
            self._held.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._mavsdk = self._held.getsockname()
            await self._transport.open()
        except OSError as error:
            self.close()
            name = self.connection.name
            raise LinkError(
                f"cannot open {name}: {error.strerror or error}",
                hint=_OPEN_HINTS.get(error.errno or 0, "check the connection in WAYDROP_CONNECTIONS or --connection"),
                connection=name,
            ) from error

    @property
    def inner_url(self) -> str:
        """Where mavsdk listens."""
        return f"udpin://{LOOPBACK}:{self._mavsdk[1]}"

    def begin(self) -> None:
        """mavsdk listens now: let frames pass."""
        sock = udp_socket(socket.AF_INET)
        sock.bind((LOOPBACK, 0))
        sock.connect(self._mavsdk)
        self._inner_socket = sock
        self._inner = DatagramReader(sock, self._outgoing)
        if self._held is not None:
            self._held.close()
            self._held = None

    def close(self) -> None:
        """Let nothing pass any more. Idempotent."""
        self._transport.close()
        if self._inner is not None:
            self._inner.close()
            self._inner = self._inner_socket = None
        if self._held is not None:
            self._held.close()
            self._held = None

    def tick(self, now_s: float) -> None:
        """Greet peers that wait for it. Called a few times a second."""
        self._transport.tick(now_s)
        if now_s - self._heartbeat_sent_s < _HEARTBEAT_PERIOD_S:
            return
        self._heartbeat_sent_s = now_s
        for peer in self._transport.awaiting_heartbeat():
            if not self._policy.owns(peer):
                self._send(Route(peer, None), self._heartbeat())

    def security(self, system: int) -> LinkSecurity:
        """What keeps others from speaking for this system."""
        return self._policy.security(system)

    def ground_station_age_s(self, system: int, station: int) -> float | None:
        """See VehicleLink, for the vehicle with the id `system`."""
        heard_s = self._policy.ground_station_heard_s(system, station)
        return None if heard_s is None else time.monotonic() - heard_s

    def watch_items(self, system: int, watcher: ItemWatcher) -> Callable[[], None]:
        """Tell `watcher` each mission item that is sent to this system, until the returned function is called.

        One at a time. The vehicle's requests say as much, but each would take mavsdk's JSON and a change of thread.
        """
        self._item_watchers[system] = watcher

        def end() -> None:
            self._item_watchers.pop(system, None)

        return end

    def keys_changed(self) -> None:
        """The key file was read again."""
        self._policy.keys_changed()

    def refused(self) -> Sequence[Refused]:
        """What was refused since it was opened."""
        name = self.connection.name
        return [
            Refused(name, kind, tally.count, tally.peer, tuple(tally.systems)) for kind, tally in self._tallies.items()
        ]

    def relayed(self) -> Relayed:
        """What passed since it was opened."""
        return Relayed(self.connection.name, self._from_vehicles, self._to_vehicles)

    async def set_up_signing(self, system: int) -> str:
        """Give a system its newest key, in the clear, and wait until it signs with it. The key's fingerprint.

        Raises:
            NotFoundError: it is not heard here, or no key was made for it. ConflictError: it uses this key already, or
            everybody would hear it. LinkTimeoutError: it goes on as before.
        """
        keys = self._store.signing.ring.of(system)
        if keys is None:
            raise NotFoundError(
                f"system {system} has no key", hint=f"make one first: `waydrop link-key create {system}`"
            )
        key = keys.newest
        if keys.current == key:
            raise ConflictError(
                f"system {system} signs with its newest key already",
                hint=f"make another one first: `waydrop link-key create {system}`",
            )
        if self._policy.security(system) is LinkSecurity.OPEN:
            raise ConflictError(
                f"{self.connection.name} is open: every peer on it would receive the key",
                hint="remove `peer=any` from the connection",
            )
        for _ in range(_SETUP_TRIES):
            routes = self._policy.routes_to(system)
            if not routes:
                raise NotFoundError(
                    f"system {system} is not heard on {self.connection.name}", hint="see `waydrop vehicles`"
                )
            timestamp = self._store.timestamp(key, former=keys.current)
            order = frames.setup_signing(system, key.secret, timestamp, sequence=self._next(), **self._sender)
            for route in routes:
                self._send(route, order)
            until_s = time.monotonic() + _SETUP_WAIT_S
            while time.monotonic() < until_s:
                await asyncio.sleep(0.05)
                now = self._store.signing.ring.of(system)  # the key file may have been read again
                if now is not None and now.current == key:
                    return key.fingerprint
        raise LinkTimeoutError(
            f"system {system} does not sign with its new key",
            hint="its firmware may know no signing (PX4 since v1.18, ArduPilot), or it is armed: PX4 refuses then",
        )

    # from the vehicles ----------------------------------------------------------------------------------------

    def deliver(self, data: bytes, peer: Peer, late: bool) -> int:
        now_s, unix_s = time.monotonic(), time.time()
        passed: list[bytes] = []
        count = size = 0
        for frame in frames.split(data):
            count += 1
            size += len(frame)
            refusal = self._policy.admit(frame, peer, now_s, unix_s)
            if refusal is None and late and frames.message_id(frame) in _AGED:
                refusal = RefusalKind.LATE
            if refusal is None:
                passed.append(frame)
            elif refusal is not RefusalKind.GROUND_STATION or not self._policy.owns(peer):  # a vehicle forwards those
                self._tally(refusal, peer, frames.system_id(frame))
                if refusal is RefusalKind.OLD_TIMESTAMP:
                    self._answer_old(frame, peer, now_s)
        if size < len(data):
            self._tally(RefusalKind.DAMAGED, peer, None)
        if self._inner_socket is None or not passed:
            return count
        self._from_vehicles += len(passed)
        for part in passed if sum(map(len, passed)) < len(data) else (data,):
            if sum(map(len, self._bundle)) + len(part) > _BUNDLE:
                self.flush()
            self._bundle.append(part)
        return count

    def flush(self) -> None:
        bundle, self._bundle = self._bundle, []
        if bundle and self._inner_socket is not None:
            with suppress(OSError):  # mavsdk is about to end
                self._inner_socket.send(b"".join(bundle))

    def refuse(self, kind: RefusalKind, peer: Peer) -> None:
        self._tally(kind, peer, None)

    def owns(self, peer: Peer) -> bool:
        return self._policy.owns(peer)

    def systems_of(self, peer: Peer) -> int:
        return self._policy.systems_of(peer)

    def lost(self, peer: Peer) -> None:
        self._policy.lost(peer)

    # to the vehicles ------------------------------------------------------------------------------------------

    def _outgoing(self, data: bytes, _from: Address, late: bool) -> None:
        for frame in frames.split(data):
            if late:
                self._tally(RefusalKind.LATE, self._ourselves, frames.target_system(frame) or None)
                continue
            if frames.message_id(frame) == frames.PING and self._is_too_early(frame):
                continue
            for route in self._policy.routes(frame):
                self._send(route, frame)
            if self._item_watchers and (item := frames.sent_item(frame)) and item.system in self._item_watchers:
                self._item_watchers[item.system](item.mission_type, item.seq)

    def _is_too_early(self, ping: bytes) -> bool:
        """Whether it is to everybody, and the one before was a moment ago."""
        if frames.target_system(ping):
            return False
        now_s = time.monotonic()
        is_too_early = now_s - self._pinged_s < _PING_PERIOD_S
        if not is_too_early:
            self._pinged_s = now_s
        return is_too_early

    def _send(self, route: Route, frame: bytes) -> None:
        peer, key = route
        if key is not None:
            frame = sign(frame, key, Signature(self._link_id, self._store.timestamp(key)))
        if self._transport.send(peer, frame):
            self._to_vehicles += 1
        else:
            self._tally(RefusalKind.CONGESTED, peer, None)

    def _answer_old(self, frame: bytes, peer: Peer, now_s: float) -> None:
        key = self._policy.answer_to_old(frame, peer, now_s)
        if key is not None:
            self._send(Route(peer, key), self._heartbeat())

    def _heartbeat(self) -> bytes:
        return frames.ground_heartbeat(sequence=self._next(), **self._sender)

    def _next(self) -> int:
        self._sequence += 1
        return self._sequence

    def _tally(self, kind: RefusalKind, peer: Peer, system: int | None) -> None:
        self._tallies.setdefault(kind, _Tally()).add(peer, system)


def transport_of(connection: Connection, receiver: FrameReceiver) -> LinkTransport:
    """Return the transport of this kind of connection."""
    host, port, options = connection.host, connection.port, connection.options
    match connection.scheme:
        case "udpin":
            return UdpListener(host, port, options, receiver)
        case "udpout":
            return UdpClient(host, port, receiver)
        case "tcpin":
            return TcpListener(host, port, options, receiver)
        case "tcpout":
            return TcpClient(host, port, receiver)
        case _:
            return SerialPort(host, port, receiver)
