"""A vehicle's link on the way to a gateway: all passes, and commands that move the vehicle or its load are counted."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Final

from pymavlink.dialects.v20 import common as mavlink

MOVING: Final = frozenset(
    {
        mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH,
        mavlink.MAV_CMD_NAV_LAND,
        mavlink.MAV_CMD_NAV_TAKEOFF,
        mavlink.MAV_CMD_DO_SET_MODE,
        mavlink.MAV_CMD_DO_REPOSITION,
        mavlink.MAV_CMD_DO_GRIPPER,
        mavlink.MAV_CMD_MISSION_START,
        mavlink.MAV_CMD_COMPONENT_ARM_DISARM,
    }
)


class CountedLink(asyncio.DatagramProtocol):
    """Made by `counted_link`. `commands` counts by MAV_CMD, repetitions of the link included."""

    def __init__(self, gateway_port: int) -> None:
        self._gateway = ("127.0.0.1", gateway_port)
        self._vehicle: tuple[str, int] | None = None
        self._parser = mavlink.MAVLink(None)
        self._parser.robust_parsing = True
        self._transport: asyncio.DatagramTransport | None = None
        self.commands: Counter[int] = Counter()

    def connection_made(self, transport: asyncio.DatagramTransport) -> None:  # type: ignore[override]
        self._transport = transport

    def datagram_received(self, data: bytes, address: tuple[str, int]) -> None:
        assert self._transport is not None
        if address != self._gateway:
            self._vehicle = address
            self._transport.sendto(data, self._gateway)
            return
        for message in self._parser.parse_buffer(data) or ():
            if message.get_type() in ("COMMAND_LONG", "COMMAND_INT") and message.command in MOVING:
                self.commands[message.command] += 1
            elif message.get_type() in ("SET_MODE", "MISSION_COUNT", "MISSION_CLEAR_ALL"):
                self.commands[message.get_msgId()] += 1
        if self._vehicle is not None:
            self._transport.sendto(data, self._vehicle)


@asynccontextmanager
async def counted_link(port: int, gateway_port: int) -> AsyncIterator[CountedLink]:
    """Between the vehicle that sends to `port`, and the gateway that listens at `gateway_port`."""
    loop = asyncio.get_running_loop()
    transport, link = await loop.create_datagram_endpoint(
        lambda: CountedLink(gateway_port), local_addr=("127.0.0.1", port)
    )
    try:
        yield link
    finally:
        transport.close()
