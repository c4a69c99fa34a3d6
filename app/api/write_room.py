"""Room to write to a client: a client that does not read is found out, and takes little memory until then."""

from __future__ import annotations

import asyncio
import socket as sockets
from typing import Final

MAX_UNSENT_BYTES: Final = 64 * 1024
"""What may wait in our process for a client's kernel buffer."""

POLL_S: Final = 0.01


async def wait_for_room(transport: asyncio.WriteTransport, timeout_s: float) -> None:
    """Return once little waits to be sent. Raises TimeoutError if the client takes too little for so long."""
    # Not by aiohttp's drain: once a task that waits in it has been cancelled, nothing can be written any more,
    # not even the close frame.
    loop = asyncio.get_running_loop()
    deadline_s = loop.time() + timeout_s
    while transport.get_write_buffer_size() > MAX_UNSENT_BYTES:
        if loop.time() > deadline_s:
            raise TimeoutError
        await asyncio.sleep(POLL_S)


def bound_kernel_buffer(transport: asyncio.Transport, size_bytes: int) -> None:
    """Left alone, the kernel takes megabytes for a client that reads nothing, and it looks well for as long."""
    raw = transport.get_extra_info("socket")
    if raw is not None:
        raw.setsockopt(sockets.SOL_SOCKET, sockets.SO_SNDBUF, size_bytes)
