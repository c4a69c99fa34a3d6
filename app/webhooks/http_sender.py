"""Sends a webhook's messages with aiohttp's client; implements WebhookSender."""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from typing import Final

import aiohttp

from app.domain.webhooks.port import Reply
from app.webhooks.name_lookup import NameLookup

TOTAL_S: Final = 15.0
CONNECT_S: Final = 5.0
MAX_HEADER_BYTES: Final = 8190
_MAX_PROBLEM_CHARS: Final = 300


class HttpSender:
    """One request for each message, on a connection of its own: a kept one may be dead when it is needed."""

    def __init__(self, session: aiohttp.ClientSession) -> None:
        self._session = session

    async def post(self, url: str, headers: Mapping[str, str], body: bytes) -> Reply:
        """See WebhookSender. Of the answer only the status line and the headers are read, however long it is.

        A problem is told in Waydrop's words and the system's, never in those of the peer.
        """
        try:
            answer = await self._session.post(url, headers=headers, data=body, allow_redirects=False)
        except TimeoutError:
            return Reply(None, "no answer in time")
        except (aiohttp.ClientError, OSError, ValueError) as error:
            return Reply(None, _in_words(error))
        try:
            return Reply(answer.status, retry_after_s=_seconds(answer.headers.get("Retry-After")))
        finally:
            answer.close()


@asynccontextmanager
async def open_sender(*, version: str, total_s: float = TOTAL_S) -> AsyncIterator[HttpSender]:
    """A sender for as long as the block lasts. It follows no redirect, keeps no cookie, and uses no proxy."""
    # no limit of connections: each webhook sends one message at a time, and must not wait for a slow receiver's
    connector = aiohttp.TCPConnector(limit=0, force_close=True, resolver=NameLookup())
    async with aiohttp.ClientSession(
        connector=connector,
        cookie_jar=aiohttp.DummyCookieJar(),
        headers={"User-Agent": f"waydrop/{version}", "Accept": "*/*"},
        timeout=aiohttp.ClientTimeout(total=total_s, sock_connect=CONNECT_S),
        auto_decompress=False,
        max_line_size=MAX_HEADER_BYTES,
        max_field_size=MAX_HEADER_BYTES,
        trust_env=False,
    ) as session:
        yield HttpSender(session)


def _in_words(error: Exception) -> str:
    """Never str(error): aiohttp puts the peer's bytes and the whole URL into it, and a URL may hold a token."""
    if isinstance(error, aiohttp.ClientResponseError):
        return "the answer is no HTTP"
    kind, reason = type(error).__name__, error.strerror if isinstance(error, OSError) else None
    if isinstance(error, aiohttp.ClientConnectorError):
        kind = f"{kind} for {error.host}"
    return f"{kind}: {reason}"[:_MAX_PROBLEM_CHARS] if reason else kind


def _seconds(retry_after: str | None) -> float | None:
    """Retry-After in seconds; its form as a date is not read: it needs the receiver's clock to be right."""
    if retry_after is None or not retry_after.isascii() or not retry_after.isdigit() or len(retry_after) > 9:
        return None
    return float(retry_after)
