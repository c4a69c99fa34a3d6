"""Names are looked up where they hold up nobody."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Iterator
from typing import Any

import pytest

from app.webhooks.http_sender import NameLookup


class HangingServers:
    """getaddrinfo that answers names of `hangs` only when it is let go."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.let_go = threading.Event()

    def getaddrinfo(self, host: str, port: int, **_: Any) -> list[Any]:
        self.asked.append(host)
        if host.startswith("hangs"):
            self.let_go.wait(60)
        if host == "defect.example":
            raise IndexError("what nobody expects")
        if host == "unknown.example":
            raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")
        return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", ("192.0.2.7", port))]


@pytest.fixture
def servers(monkeypatch: pytest.MonkeyPatch) -> Iterator[HangingServers]:
    hanging = HangingServers()
    monkeypatch.setattr(socket, "getaddrinfo", hanging.getaddrinfo)
    yield hanging
    hanging.let_go.set()


async def test_many_names_that_hang_hold_up_neither_another_one_nor_the_loops_threads(servers: HangingServers) -> None:
    lookup = NameLookup()
    waiting = [asyncio.create_task(lookup.resolve(f"hangs-{number}.example", 443)) for number in range(40)]
    async with asyncio.timeout(30):
        found = await lookup.resolve("good.example", 443)
        assert await asyncio.to_thread(lambda: "a thread") == "a thread"
    assert [(one["hostname"], one["host"], one["port"]) for one in found] == [("good.example", "192.0.2.7", 443)]
    servers.let_go.set()
    assert [one[0]["host"] for one in await asyncio.gather(*waiting)] == ["192.0.2.7"] * 40


async def test_who_asks_again_meanwhile_waits_for_the_same_lookup(servers: HangingServers) -> None:
    lookup = NameLookup()
    for _ in range(5):  # as attempts that time out do
        attempt = asyncio.create_task(lookup.resolve("hangs.example", 443))
        await asyncio.sleep(0)
        attempt.cancel()
        await asyncio.wait({attempt})
    last = asyncio.create_task(lookup.resolve("hangs.example", 443))
    servers.let_go.set()
    assert (await last)[0]["host"] == "192.0.2.7"
    assert servers.asked == ["hangs.example"]
    await lookup.resolve("hangs.example", 443)
    assert len(servers.asked) == 2, "nothing is kept: addresses change"


async def test_a_name_that_does_not_exist_is_an_os_error(servers: HangingServers) -> None:
    with pytest.raises(OSError, match="not known"):
        await NameLookup().resolve("unknown.example", 443)


async def test_a_label_too_long_for_a_host_name_is_an_os_error() -> None:
    with pytest.raises(OSError, match="not a host name"):
        await NameLookup().resolve("a" * 64 + ".example", 443)


async def test_without_a_thread_the_lookup_fails_and_the_next_one_works(
    servers: HangingServers, monkeypatch: pytest.MonkeyPatch
) -> None:
    lookup = NameLookup()
    with monkeypatch.context() as patch:
        patch.setattr(threading.Thread, "start", no_thread)
        async with asyncio.timeout(30):
            with pytest.raises(OSError, match="no thread"):
                await lookup.resolve("good.example", 443)
    async with asyncio.timeout(30):
        assert (await lookup.resolve("good.example", 443))[0]["host"] == "192.0.2.7"


async def test_who_waits_is_told_of_an_error_that_nobody_expected(
    servers: HangingServers, monkeypatch: pytest.MonkeyPatch
) -> None:
    logged: list[str] = []
    monkeypatch.setattr(threading, "excepthook", lambda error: logged.append(error.exc_type.__name__))
    lookup = NameLookup()
    async with asyncio.timeout(30):
        for _ in range(2):
            with pytest.raises(OSError, match="failed"):
                await lookup.resolve("defect.example", 443)
        while len(logged) < 2:
            await asyncio.sleep(0.01)
    assert logged == ["IndexError"] * 2, "a defect is not hidden"
    assert servers.asked == ["defect.example"] * 2, "the failed one is not kept"


def no_thread(_: threading.Thread) -> None:
    raise RuntimeError("can't start new thread")
