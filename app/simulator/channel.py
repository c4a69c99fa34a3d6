"""One MAVLink link of one vehicle: a UDP socket, packing, parsing, and the faults of the way between."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Callable
from typing import cast

from app.simulator.dialect import Message, mavlink
from app.simulator.faults import LinkFaults
from app.simulator.faulty_way import Deliver, FaultyWay, Later

Address = tuple[str, int]
Receive = Callable[["Channel", Message], None]

GCS_TIMEOUT_S = 3.0


class Channel(asyncio.DatagramProtocol):
    """Sends to `remote` as PX4 does: from the first moment, whether or not anybody listens.

    A ground station that speaks first from another address becomes the remote, unless the present one is alive.
    `wall` gives wall-clock seconds, `later` waits for some of them.
    """

    def __init__(
        self,
        remote: Address,
        faults: LinkFaults,
        rng: random.Random,
        receive: Receive,
        wall: Callable[[], float],
        later: Later | None = None,
    ) -> None:
        self.remote = remote
        self.gcs_heard_s: float | None = None
        """A GCS heartbeat has been received here: STATUSTEXT goes out."""
        self._faults = faults
        later = later or _by_the_event_loop
        self._up = FaultyWay(faults, random.Random(rng.getrandbits(64)), later)
        self._down = FaultyWay(faults, rng, later)
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
        self._up.carry(lambda: self._parse(data, addr))

    # sending ------------------------------------------------------------------------------------------------

    def send(self, message: Message, system_id: int, component_id: int) -> None:
        """Pack as (system, component) with that sender's own sequence, and send."""
        packer = self._packers.get((system_id, component_id))
        if packer is None:
            packer = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
            self._packers[system_id, component_id] = packer
        datagram = bytes(message.pack(packer))
        packer.seq = (packer.seq + 1) % 256
        self._down.carry(lambda: self._transmit(datagram))

    def close(self) -> None:
        """No more messages."""
        if self._transport is not None:
            self._transport.close()

    def _transmit(self, datagram: bytes) -> None:
        if self._transport is not None and not self._faults.link_cut:
            self._transport.sendto(datagram, self.remote)

    # receiving ----------------------------------------------------------------------------------------------

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


def _by_the_event_loop(wait_s: float, deliver: Deliver) -> None:
    asyncio.get_running_loop().call_later(wait_s, deliver)
