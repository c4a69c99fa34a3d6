"""What a peer says that is no receiver stays untold, and so does the URL: it may hold a token."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from app.domain.webhooks.webhook import Reply
from app.webhooks import open_sender

BANNER = b"SSH-2.0-OpenSSH_9.6p1 inside-host"
TOKEN = "in-the-url"


@asynccontextmanager
async def peer(words: bytes) -> AsyncIterator[str]:
    """A TCP service that says `words` to whoever connects and hangs up; its URL with a token."""

    async def speak(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readuntil(b"\r\n\r\n")
        writer.write(words)
        writer.close()

    server = await asyncio.start_server(speak, "127.0.0.1", 0)
    async with server:
        yield f"http://127.0.0.1:{server.sockets[0].getsockname()[1]}/hook?key={TOKEN}"


async def reply_of(url: str) -> Reply:
    async with open_sender(version="0.0-test", total_s=30.0) as sender:
        return await sender.post(url, {"Content-Type": "application/json"}, b"{}")


@pytest.mark.parametrize(
    "words",
    [
        BANNER + b"\r\n",
        b"HTTP/1.1 200 OK\r\n" + BANNER + b"\r\n\r\n",
        b"HTTP/1.1 200 OK\r\nContent-Length: " + BANNER + b"\r\n\r\n",
        b"HTTP/1.1 200 OK\r\nX-Long: " + BANNER * 1000 + b"\r\n\r\n",
    ],
)
async def test_an_answer_that_is_no_http_is_told_in_our_words_alone(words: bytes) -> None:
    async with peer(words) as url:
        assert await reply_of(url) == Reply(None, "the response is not HTTP")


@pytest.mark.parametrize("words", [b"", b"HTTP/1.1 200 OK\r\nX-Half: inside-ho"])
async def test_a_peer_that_hangs_up_is_told_without_the_url(words: bytes) -> None:
    async with peer(words) as url:
        reply = await reply_of(url)
    assert reply.status is None
    assert reply.problem
    assert TOKEN not in reply.problem
    assert "inside" not in reply.problem


async def test_a_refused_connection_is_told_with_the_systems_words() -> None:
    async with peer(b"") as url:
        pass
    reply = await reply_of(url)
    assert reply.problem.startswith("ClientConnectorError for 127.0.0.1: ")
    assert TOKEN not in reply.problem


async def test_a_url_that_cannot_be_used_is_not_repeated() -> None:
    reply = await reply_of(f"http://:80/hook?key={TOKEN}")
    assert reply.status is None
    assert reply.problem
    assert TOKEN not in reply.problem
