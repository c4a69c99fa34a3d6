"""No answer tells which software in which version made it."""

from __future__ import annotations

import pytest

from tests.support.raw_socket import HANDSHAKE, head_of, status_of
from tests.support.service_in_process import Service

HEAD = "Host: 127.0.0.1\r\nConnection: close\r\n"
REQUESTS = {
    200: f"GET /healthz HTTP/1.1\r\n{HEAD}\r\n",
    404: f"GET /nothing HTTP/1.1\r\n{HEAD}\r\n",
    405: f"DELETE /healthz HTTP/1.1\r\n{HEAD}\r\n",
    400: "GET / HTTP/9\r\nnothing\r\n\r\n",
    417: f"POST /api/v1/plans HTTP/1.1\r\n{HEAD}Expect: miracles\r\nContent-Length: 2\r\n\r\n{{}}",
    413: f"POST /api/v1/plans HTTP/1.1\r\n{HEAD}Content-Type: application/json\r\nContent-Length: 99999999\r\n\r\n",
    421: "GET /api/v1/runs HTTP/1.1\r\nHost: evil.example\r\nConnection: close\r\n\r\n",
    101: HANDSHAKE.format(path="/api/v1/stream?after=99999"),
}


@pytest.mark.parametrize("status", REQUESTS)
async def test_the_server_header_has_no_version(service: Service, status: int) -> None:
    answer = await head_of(service.port, REQUESTS[status].encode())
    head = answer.lower()
    assert status_of(answer) == status
    assert b"\r\nserver: waydrop" in head
    assert b"aiohttp" not in head
    assert b"python" not in head
