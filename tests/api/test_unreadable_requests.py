"""What is no HTTP is answered as everything else is refused, and what it said stays out of the log."""

from __future__ import annotations

import json
import logging

import pytest

from tests.support.connections import LIMITS, served
from tests.support.raw_socket import exchange, status_of

SECRET = b"wd_a-secret-that-nobody-may-read"


@pytest.mark.parametrize(
    "request_bytes",
    [
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer \x01" + SECRET + b"\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization : Bearer " + SECRET + b"\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer " + SECRET * 1000 + b"\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nBearer " + SECRET + b"\r\n\r\n",
        b"G\x00T /?token=" + SECRET + b" HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: " + SECRET + b"\r\n\r\n",
    ],
)
async def test_a_request_that_is_none_is_a_problem_and_its_secret_is_not_told(
    caplog: pytest.LogCaptureFixture, request_bytes: bytes
) -> None:
    caplog.set_level(logging.DEBUG)
    async with served(LIMITS) as port:
        answer = await exchange(port, request_bytes)
    head, _, body = answer.partition(b"\r\n\r\n")
    assert status_of(answer) == 400
    assert b"Content-Type: application/problem+json" in head
    assert b"Server: waydrop\r\n" in head + b"\r\n"
    problem = json.loads(body)
    assert (problem["code"], problem["status"]) == ("request.not_http", 400)
    assert SECRET not in answer
    assert SECRET.decode() not in caplog.text
