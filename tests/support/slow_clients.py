"""A client that does not read is cut, and the others feel nothing."""

from __future__ import annotations

from tests.support.service_in_process import Service


async def closed(service: Service, code: int) -> int:
    """How many sockets the service has closed with a code."""
    _, _, text = await service.call("GET", "/metrics")
    found = [line for line in text.splitlines() if line.startswith(f'waydrop_websocket_closed_total{{code="{code}"}}')]
    return int(float(found[0].split()[-1])) if found else 0
