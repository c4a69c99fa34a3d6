"""Host names to addresses, on threads that hold up nobody.

aiohttp's own resolver uses the loop's thread pool: a few names whose servers hang would fill it, and everything else
that needs a thread would wait. A thread per name cannot do that, and a daemon does not keep the process from ending.
"""

from __future__ import annotations

import asyncio
import errno
import socket
import threading
from contextlib import suppress
from typing import Any

from aiohttp.abc import AbstractResolver, ResolveResult

_Key = tuple[str, int, int]


class NameLookup(AbstractResolver):
    """At most one lookup of a name at a time: who asks meanwhile waits for the same one."""

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
                raise OSError(errno.EAGAIN, "no thread for looking up a name") from error
            self._under_way[key] = found  # only now: nobody waits for a lookup that never began
            found.add_done_callback(lambda done: self._forget(key, done))
        return await asyncio.shield(self._under_way[key])

    async def close(self) -> None:
        """Nothing is held; a lookup that hangs ends by itself."""

    def _forget(self, key: _Key, done: asyncio.Future[list[ResolveResult]]) -> None:
        self._under_way.pop(key, None)
        if not done.cancelled():
            done.exception()  # whoever asked may have gone


def _look_up(host: str, port: int, family: socket.AddressFamily, found: asyncio.Future[list[ResolveResult]]) -> None:
    # what an error outside the expected ones leaves: who waits must be told, whatever ends this thread
    outcome: list[ResolveResult] | OSError = OSError(errno.EIO, "the lookup of a name failed")
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
