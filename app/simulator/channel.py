"""One MAVLink link of one vehicle: a UDP socket, packing, parsing, and the faults of the way between."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Callable
from typing import cast

from app.simulator.dialect import Message, mavlink
from app.simulator.faults import LinkFaults

Address = tuple[str, int]
Receive = Callable[["Channel", Message], None]

REORDER_HOLD_S = 0.05
GCS_TIMEOUT_S = 3.0


class Channel(asyncio.DatagramProtocol):
    """Sends to `remote` as PX4 does: from the first moment, whether or not anybody listens.

    A ground station that speaks first from another address becomes the remote, unless the present one is alive.
    `wall` gives wall-clock seconds.
    """

    def __init__(
        self, remote: Address, faults: LinkFaults, rng: random.Random, receive: Receive, wall: Callable[[], float]
    ) -> None:
        self.remote = remote
        self.gcs_heard_s: float | None = None
        """A GCS heartbeat has been received here: STATUSTEXT goes out."""
        self._faults = faults
        self._rng = rng
        self._receive = receive
        self._wall = wall
        self._heard_at_s = -GCS_TIMEOUT_S
        self._transport: asyncio.DatagramTransport | None = None
        self._parser = mavlink.MAVLink(None)
        self._parser.robust_parsing = True
        self._packers: dict[tuple[int, int], Message] = {}

    @property
    def local_address(self) -> str:
        """Where the vehicle's socket is bound."""
        if self._transport is None:
            return "closed"
        host, port = self._transport.get_extra_info("sockname")[:2]
        return f"{host}:{port}"

    # asyncio.DatagramProtocol -------------------------------------------------------------------------------

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.DatagramTransport, transport)

    def connection_lost(self, exc: Exception | None) -> None:
        self._transport = None

    def error_received(self, exc: Exception) -> None:
        """Nobody listens at the remote (ECONNREFUSED): a vehicle does not care."""

    def datagram_received(self, data: bytes, addr: Address) -> None:
        self._pass(lambda: self._parse(data, addr))

    # sending ------------------------------------------------------------------------------------------------

    def send(self, message: Message, system_id: int, component_id: int) -> None:
        """Pack as (system, component) with that sender's own sequence, and send."""
        packer = self._packers.get((system_id, component_id))
        if packer is None:
            packer = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
            self._packers[system_id, component_id] = packer
        datagram = bytes(message.pack(packer))
        packer.seq = (packer.seq + 1) % 256
        self._pass(lambda: self._transmit(datagram))

    def close(self) -> None:
        """No more messages."""
        if self._transport is not None:
            self._transport.close()

    def _transmit(self, datagram: bytes) -> None:
        if self._transport is not None and not self._faults.link_cut:
            self._transport.sendto(datagram, self.remote)

    # the way between ----------------------------------------------------------------------------------------

    def _pass(self, deliver: Callable[[], None]) -> None:
        faults = self._faults
        if faults.link_cut or (faults.loss and self._rng.random() < faults.loss):
            return
        copies = 2 if faults.duplicate and self._rng.random() < faults.duplicate else 1
        for _ in range(copies):
            wait_s = faults.delay_s + (self._rng.random() * faults.jitter_s if faults.jitter_s else 0.0)
            if faults.reorder and self._rng.random() < faults.reorder:
                wait_s += REORDER_HOLD_S
            if wait_s > 0.0:
                asyncio.get_running_loop().call_later(wait_s, deliver)
            else:
                deliver()

    def _parse(self, data: bytes, addr: Address) -> None:
        if self._faults.link_cut:
            return
        self._follow(addr)
        for message in self._parser.parse_buffer(data) or ():
            if message.get_type() != "BAD_DATA":
                self._receive(self, message)

    def _follow(self, addr: Address) -> None:
        now_s = self._wall()
        if addr[:2] != self.remote and now_s - self._heard_at_s < GCS_TIMEOUT_S:
            return
        self.remote = (addr[0], addr[1])
        self._heard_at_s = now_s
