"""How many sockets there may be, what they may send, and how they end."""

from __future__ import annotations

import asyncio

from tests.support.service_in_process import Service

HANDSHAKE = {
    "Connection": "Upgrade",
    "Upgrade": "websocket",
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "MDEyMzQ1Njc4OWFiY2RlZg==",
}


async def sockets_open(service: Service, count: int) -> None:
    """Wait until the service has taken so many sockets."""
    async with asyncio.timeout(60):
        while f"waydrop_websocket_clients {count}.0" not in (await service.call("GET", "/metrics"))[2]:
            await asyncio.sleep(0.01)
