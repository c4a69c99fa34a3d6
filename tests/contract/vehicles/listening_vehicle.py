"""A vehicle that only says that it is there and keeps what it hears: decoded by another MAVLink than the sender's."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from typing import Any

from app.simulator.dialect import mavlink
from tests.support.driving import until
from tests.support.simulated import free_udp_ports

HEARD_WITHIN_S = 15.0


class ListeningVehicle(asyncio.DatagramProtocol):
    """System 1, component 1, a PX4 multicopter by its HEARTBEAT."""

    def __init__(self, port: int) -> None:
        self.url = f"udpin://127.0.0.1:{port}"
        self.received: list[Any] = []
        self.times_s: list[float] = []
        self.base_mode = self.custom_mode = 0
        self.on_heard: Callable[[Any], None] = lambda _message: None
        self._remote = ("127.0.0.1", port)
        self._mavlink = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
        self._mavlink.robust_parsing = True
        self._transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: Any) -> None:
        self._transport = transport

    def error_received(self, exc: Exception) -> None:
        """Nobody listens yet."""

    def datagram_received(self, data: bytes, addr: Any) -> None:
        for message in self._mavlink.parse_buffer(data) or ():
            self.received.append(message)
            self.times_s.append(asyncio.get_running_loop().time())
            self.on_heard(message)

    async def beat(self) -> None:
        """HEARTBEAT five times a second."""
        while True:
            beat = mavlink.MAVLink_heartbeat_message(2, 12, self.base_mode, self.custom_mode, 4, 3)
            assert self._transport is not None
            self._transport.sendto(bytes(beat.pack(self._mavlink)), self._remote)
            await asyncio.sleep(0.2)

    def of(self, name: str) -> list[Any]:
        """All messages of this name."""
        return [message for message in self.received if message.get_type() == name]

    async def first(self, name: str) -> Any:
        """The first message of this name."""
        await until(lambda: bool(self.of(name)), f"{name} must arrive", HEARD_WITHIN_S)
        return self.of(name)[0]


@asynccontextmanager
async def listening_vehicle() -> AsyncIterator[ListeningVehicle]:
    """It beats until the end."""
    vehicle = ListeningVehicle(free_udp_ports(1))
    transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(
        lambda: vehicle, local_addr=("127.0.0.1", 0)
    )
    beating = asyncio.create_task(vehicle.beat())
    try:
        yield vehicle
    finally:
        beating.cancel()
        with suppress(asyncio.CancelledError):
            await beating
        transport.close()
