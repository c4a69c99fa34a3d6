"""Sends a webhook's messages with aiohttp's client; implements WebhookSender."""

from __future__ import annotations

import asyncio
import errno
import socket
import threading
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager, suppress
from typing import Any, Final

import aiohttp
from aiohttp.abc import AbstractResolver, ResolveResult

from app.domain.webhooks.webhook import Reply

# Resolves host names on threads, without blocking the loop.
#
# aiohttp's own resolver uses the loop's thread pool: a few names whose servers hang would fill it, and everything
# else that needs a thread would wait. A thread per name cannot do that, and a daemon does not keep the process from
# ending.


_Key = tuple[str, int, int]


class NameLookup(AbstractResolver):
    """At most one lookup of a name at a time: further callers wait for the same one."""

    def __init__(self) -> None:
        self._under_way: dict[_Key, asyncio.Future[list[ResolveResult]]] = {}

    async def resolve(
        self, host: str, port: int = 0, family: socket.AddressFamily = socket.AF_INET
    ) -> list[ResolveResult]:
        """The addresses of a name. Raises OSError."""
        key = (host, port, int(family))
        if key not in self._under_way:
            found: asyncio.Future[list[ResolveResult]] = asyncio.get_running_loop().create_future()
            try:
                threading.Thread(target=_look_up, args=(host, port, family, found), daemon=True).start()
            except (RuntimeError, MemoryError) as error:
                raise OSError(errno.EAGAIN, "no thread available for name resolution") from error
            self._under_way[key] = found  # only now: nobody waits for a lookup that never started
            found.add_done_callback(lambda done: self._forget(key, done))
        return await asyncio.shield(self._under_way[key])

    async def close(self) -> None:
        """Nothing is held; a lookup that hangs ends by itself."""

    def _forget(self, key: _Key, done: asyncio.Future[list[ResolveResult]]) -> None:
        self._under_way.pop(key, None)
        if not done.cancelled():
            done.exception()  # the caller may be gone


def _look_up(host: str, port: int, family: socket.AddressFamily, found: asyncio.Future[list[ResolveResult]]) -> None:
    # after an unexpected error: waiting callers must be notified, whatever ends this thread
    outcome: list[ResolveResult] | OSError = OSError(errno.EIO, "name resolution failed")
    try:
        answers = socket.getaddrinfo(host, port, family=family, type=socket.SOCK_STREAM)
        outcome = [_result(host, answer) for answer in answers]
    except OSError as error:
        outcome = error
    except UnicodeError:
        outcome = socket.gaierror(socket.EAI_NONAME, "not a host name")
    finally:
        with suppress(RuntimeError):  # the loop was closed meanwhile
            found.get_loop().call_soon_threadsafe(_settle, found, outcome)


def _settle(found: asyncio.Future[list[ResolveResult]], outcome: list[ResolveResult] | OSError) -> None:
    if found.done():
        return
    if isinstance(outcome, OSError):
        found.set_exception(outcome)
    else:
        found.set_result(outcome)


def _result(host: str, answer: tuple[Any, ...]) -> ResolveResult:
    family, _, protocol, _, address = answer
    shown = socket.getnameinfo(address, socket.NI_NUMERICHOST | socket.NI_NUMERICSERV)[0]
    numeric = socket.AI_NUMERICHOST | socket.AI_NUMERICSERV
    return ResolveResult(hostname=host, host=shown, port=address[1], family=family, proto=protocol, flags=numeric)


TOTAL_S: Final = 15.0
CONNECT_S: Final = 5.0
MAX_HEADER_BYTES: Final = 8190
_MAX_PROBLEM_CHARS: Final = 300


class HttpSender:
    """One request for each message, on a connection of its own: a kept one may be dead when it is needed."""

    def __init__(self, session: aiohttp.ClientSession) -> None:
        self._session = session

    async def post(self, url: str, headers: Mapping[str, str], body: bytes) -> Reply:
        """See WebhookSender. Only the status line and the headers of the response are read, whatever its length.

        A problem is described by Waydrop or the system, never by text of the peer.
        """
        try:
            answer = await self._session.post(url, headers=headers, data=body, allow_redirects=False)
        except TimeoutError:
            return Reply(None, "no response in time")
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
        return "the response is not HTTP"
    kind, reason = type(error).__name__, error.strerror if isinstance(error, OSError) else None
    if isinstance(error, aiohttp.ClientConnectorError):
        kind = f"{kind} for {error.host}"
    return f"{kind}: {reason}"[:_MAX_PROBLEM_CHARS] if reason else kind


def _seconds(retry_after: str | None) -> float | None:
    """Retry-After in seconds; its form as a date is not read: it needs the receiver's clock to be right."""
    if retry_after is None or not retry_after.isascii() or not retry_after.isdigit() or len(retry_after) > 9:
        return None
    return float(retry_after)
