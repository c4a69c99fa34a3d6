"""One MAVLink link of one vehicle: a UDP socket, packing, parsing, and the faults of the way between."""

from __future__ import annotations

import asyncio
import random
from collections import deque
from collections.abc import Callable
from typing import Protocol, cast

from app.simulator.clock import VehicleClock
from app.simulator.dialect import Message, mavlink
from app.simulator.faults import LinkFaults
from app.simulator.signing import SigningMavlink
from app.simulator.wire import VEHICLE_COMPONENT, Severity

TEXT_CHUNK_BYTES = 50
CONNECTED_S = 2.5
"""A link counts as connected so long after a GCS heartbeat (wall time)."""
STALE_S = 5.0
"""A text waits so long for a link to be connected [03_upload_bad, 24_link_loss]."""
TEXTS_KEPT = 8


class Sender(Protocol):
    """A channel as the radio sees it."""

    gcs_heard_s: float | None
    """Vehicle time of the newest GCS heartbeat on it; None before the first."""

    def send(self, message: Message, system_id: int, component_id: int) -> None: ...


class Radio:
    """The vehicle's voice. `system_id` is read at every message, because MAV_SYS_ID may change at a reboot."""

    def __init__(self, system_id: int, clock: VehicleClock) -> None:
        self.system_id = system_id
        self._clock = clock
        clock.on_speed(self._change_speed)
        self.channels: list[Sender] = []
        self.silent = False
        """Power is off (a reboot): nothing is sent."""
        self._text_id = 0
        self._texts: deque[tuple[float, Severity, str]] = deque(maxlen=TEXTS_KEPT)

    @property
    def _connected_s(self) -> float:
        """CONNECTED_S of wall time, in vehicle time."""
        return CONNECTED_S * self._clock.speed

    def _change_speed(self, factor: float) -> None:
        for channel in self.channels:
            if channel.gcs_heard_s is not None:
                channel.gcs_heard_s = self._clock.same_by_the_wall(channel.gcs_heard_s, factor)

    def boot(self) -> None:
        """Power-up: nothing has been said, and no ground station heard."""
        self.silent = False
        self._texts.clear()
        for channel in self.channels:
            channel.gcs_heard_s = None

    def broadcast(self, message: Message, component_id: int = VEHICLE_COMPONENT) -> None:
        """Send on every channel."""
        for channel in self.channels:
            self.reply(channel, message, component_id)

    def reply(self, channel: Sender, message: Message, component_id: int = VEHICLE_COMPONENT) -> None:
        """Send on the channel a request came from."""
        if not self.silent:
            channel.send(message, self.system_id, component_id)

    def forward(self, channel: Sender, message: Message) -> None:
        """Send what came on one channel on the others, as from its sender: PX4 forwards (`mavlink start -f`)."""
        for other in self.channels:
            if other is not channel:
                other.send(message, message.get_srcSystem(), message.get_srcComponent())

    def on_gcs_heartbeat(self, channel: Sender) -> None:
        """A ground station lives on this channel; if it is new there, it hears what was said a moment ago."""
        now_s = self._clock.now_s
        heard_s, connected = channel.gcs_heard_s, self._connected(channel)
        channel.gcs_heard_s = now_s
        if connected:
            return
        unheard_s = now_s - STALE_S if heard_s is None else max(now_s - STALE_S, heard_s + self._connected_s)
        for said_s, severity, text in self._texts:
            if said_s > unheard_s:
                self._send_text([channel], severity, text)

    def _connected(self, channel: Sender) -> bool:
        heard_s = channel.gcs_heard_s
        return heard_s is not None and self._clock.now_s - heard_s <= self._connected_s

    def text(self, severity: Severity, text: str) -> None:
        """STATUSTEXT where a GCS heartbeat was heard lately; elsewhere it waits a little for one."""
        self._texts.append((self._clock.now_s, severity, text))
        self._send_text([channel for channel in self.channels if self._connected(channel)], severity, text)

    def _send_text(self, listeners: list[Sender], severity: Severity, text: str) -> None:
        """More than 50 bytes come in chunks with one id.

        PX4's texts end in a tab, which tells newer ground stations that an EVENT says the same.
        """
        if not listeners:
            return
        raw = (text + "\t").encode()
        self._text_id = (self._text_id + 1) % 65536
        for chunk in range((len(raw) + TEXT_CHUNK_BYTES - 1) // TEXT_CHUNK_BYTES):
            part = raw[chunk * TEXT_CHUNK_BYTES : (chunk + 1) * TEXT_CHUNK_BYTES]
            message = mavlink.MAVLink_statustext_message(severity, part, self._text_id, chunk)
            for channel in listeners:
                self.reply(channel, message)


# One direction of a link: what its faults do to each datagram on the way.


REORDER_HOLD_S = 0.05

Deliver = Callable[[], None]
Later = Callable[[float, Deliver], object]
"""Calls something so many wall-clock seconds later."""


class FaultInjector:
    """Its chances come from its own `rng` alone, one draw after the other: what comes the other way changes nothing."""

    def __init__(self, faults: LinkFaults, rng: random.Random, later: Later) -> None:
        self._faults = faults
        self._rng = rng
        self._later = later

    def carry(self, deliver: Deliver) -> None:
        """Deliver one datagram: now, later, twice or not at all."""
        faults = self._faults
        if faults.link_cut or (faults.loss and self._rng.random() < faults.loss):
            return
        copies = 2 if faults.duplicate and self._rng.random() < faults.duplicate else 1
        for _ in range(copies):
            wait_s = faults.delay_s + (self._rng.random() * faults.jitter_s if faults.jitter_s else 0.0)
            if faults.reorder and self._rng.random() < faults.reorder:
                wait_s += REORDER_HOLD_S
            if wait_s > 0.0:
                self._later(wait_s, deliver)
            else:
                deliver()


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
        signing: Message | None = None,
    ) -> None:
        """`signing` is shared by all that is packed and parsed here; None: nothing is signed."""
        self.remote = remote
        self.gcs_heard_s: float | None = None
        """A GCS heartbeat has been received here: STATUSTEXT goes out."""
        self._faults = faults
        later = later or _by_the_event_loop
        self._up = FaultInjector(faults, random.Random(rng.getrandbits(64)), later)
        self._down = FaultInjector(faults, rng, later)
        self._receive = receive
        self._wall = wall
        self._heard_at_s = -GCS_TIMEOUT_S
        self._transport: asyncio.DatagramTransport | None = None
        self._signing = signing or mavlink.MAVLinkSigning()
        self._parser = SigningMavlink(None)
        self._parser.robust_parsing = True
        self._parser.signing = self._signing
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
            packer.signing = self._signing
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
