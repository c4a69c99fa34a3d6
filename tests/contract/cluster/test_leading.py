"""One node writes and does what is done once for all. One that has lost this right learns of it in time."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager, closing
from pathlib import Path

import asyncpg
import pytest

from app.cluster import BusSettings, open_bus
from app.domain.cluster.errors import BusDownError, GatewayUnreachableError, NoReplyError
from app.domain.cluster.ports import Bus
from app.domain.errors import StorageError
from app.services.clock import SystemClock
from app.services.projection import Projection
from app.services.remote.journal import ClusterJournal
from app.storage.postgres import open_cluster_storage
from tests.support.cluster_servers import PostgresDatabases
from tests.support.cut_point import CutPoint, cut_point
from tests.support.service_process import until
from tests.support.stored_samples import event
from tools.cluster_servers import NatsServer

SOON_S = 60.0
LEARNS_S = 30.0
"""A loaded machine needs some seconds more than the node. One that takes leave in vain needs a minute to end."""
READS_ON_S = 25.0
"""A node looks each 5 s, waits 3 s for the answer, and connects."""
END_LEADER = (
    "SELECT pg_terminate_backend(pid) FROM pg_locks WHERE locktype = 'advisory' AND granted "
    "AND database = (SELECT oid FROM pg_database WHERE datname = current_database())"
)


async def execute(url: str, statement: str) -> None:
    connection = await asyncpg.connect(url)
    try:
        await connection.execute(statement)
    finally:
        await connection.close()


class Nodes:
    """API nodes as far as they lead: `leading` are those that do what is done once for all, `begun` all that began."""

    def __init__(self, url: str, key_file: Path) -> None:
        self.leading: list[str] = []
        self.begun: list[str] = []
        self.url = url
        self._key_file = key_file

    @asynccontextmanager
    async def node(self, name: str, nats_url: str, url: str = "") -> AsyncIterator[None]:
        """A node until the block ends."""
        async with (
            open_cluster_storage(url or self.url, key_file=self._key_file) as store,
            open_bus(BusSettings(servers=(nats_url,), name=name)) as bus,
        ):
            projection = Projection(store.projection, bus, SystemClock(), self._also(name))
            projection.start()
            try:
                yield
            finally:
                await projection.close()

    async def until_leading(self, *names: str, within_s: float = SOON_S) -> None:
        """Wait until these lead, and no other one."""

        async def found() -> list[str]:
            return sorted(self.leading)

        wanted = sorted(names)
        await until(found, lambda leading: leading == wanted, f"{wanted} must lead, and nobody else", within_s)

    def _also(self, name: str) -> Callable[..., AbstractAsyncContextManager[None]]:
        @asynccontextmanager
        async def also(*_: object) -> AsyncIterator[None]:
            self.leading.append(name)
            self.begun.append(name)
            try:
                yield
            finally:
                self.leading.remove(name)

        return also


@pytest.fixture
async def nodes(tmp_path: Path, databases: PostgresDatabases) -> Nodes:
    return Nodes(await asyncio.to_thread(databases.with_tables), tmp_path / "key")


def at(url: str, point: CutPoint) -> str:
    """The same server behind a cut point."""
    before, _, after = url.rpartition(":")
    return f"{before}:{point.port}{after.lstrip('0123456789')}"


def port_of(url: str) -> int:
    return int("".join(one for one in url.rpartition(":")[2].partition("/")[0] if one.isdigit()))


async def test_a_node_whose_lock_is_gone_ends_what_one_does_for_all_though_no_event_comes(
    nodes: Nodes, nats: NatsServer
) -> None:
    """Else both send webhooks, and one that is made at the old node is delivered by nobody, until an event comes."""
    async with AsyncExitStack() as stack:
        await stack.enter_async_context(nodes.node("old", nats.url))
        await nodes.until_leading("old")
        await stack.enter_async_context(nodes.node("new", nats.url))
        for _ in range(5):  # the old one may be the first again
            count = len(nodes.begun)
            await execute(nodes.url, END_LEADER)
            await until(
                lambda: asyncio.sleep(0, len(nodes.begun)),
                lambda now, count=count: now > count,  # type: ignore[misc]
                "one of them leads",
                SOON_S,
            )
            if nodes.begun[-1] == "new":
                break
        await nodes.until_leading("new", within_s=LEARNS_S)


async def test_a_node_whose_connection_is_lost_in_silence_ends_what_one_does_for_all(
    nodes: Nodes, nats: NatsServer
) -> None:
    async with cut_point(port_of(nodes.url)) as point, AsyncExitStack() as old:
        await old.enter_async_context(nodes.node("old", nats.url, at(nodes.url, point)))
        await nodes.until_leading("old")
        point.lose()
        point.cut()
        async with nodes.node("new", nats.url):
            await execute(nodes.url, END_LEADER)
            await nodes.until_leading("new", within_s=LEARNS_S)
        async with asyncio.timeout(LEARNS_S):  # a stopped node takes no leave of a server that is not there
            await old.aclose()


async def test_who_asks_for_the_right_after_it_has_ended_is_told_so(
    tmp_path: Path, databases: PostgresDatabases
) -> None:
    """A request may still be under way: without an answer, who asked would have to look what was done."""
    url = await asyncio.to_thread(databases.with_tables)
    async with open_cluster_storage(url, key_file=tmp_path / "key") as store:
        async with store.projection.leading() as writer:
            await writer.check()
            await execute(url, END_LEADER)
            for _ in range(2):  # the second time SQLAlchemy knows
                with pytest.raises(StorageError):
                    await writer.check()
        with pytest.raises(StorageError):
            await writer.check()


async def test_a_node_that_reaches_no_nats_lets_another_one_write(nodes: Nodes, nats: NatsServer) -> None:
    async with cut_point(port_of(nats.url)) as point, nodes.node("old", at(nats.url, point)):
        await nodes.until_leading("old")
        async with nodes.node("new", nats.url):
            point.cut()
            await nodes.until_leading("new")


async def test_a_node_whose_listening_connection_is_lost_in_silence_goes_on_reading(
    tmp_path: Path, databases: PostgresDatabases
) -> None:
    """Else its clients get no event any more, and nobody learns of it."""
    url = await asyncio.to_thread(databases.with_tables)
    seen: list[int] = []
    async with (
        cut_point(port_of(url)) as point,
        open_cluster_storage(url, key_file=tmp_path / "key") as store,
        open_cluster_storage(at(url, point), key_file=tmp_path / "key") as behind,
    ):
        journal = ClusterJournal(behind.events, SystemClock())
        await journal.start()
        try:
            with closing(journal.subscribe(100)) as events:
                await store.events.append([event(1)])
                async with asyncio.timeout(SOON_S):
                    seen.append((await events.get()).position)
                point.lose()
                await store.events.append([event(2)])
                async with asyncio.timeout(READS_ON_S):
                    seen.append((await events.get()).position)
        finally:
            await journal.close()
    assert seen == [1, 2]


async def test_a_request_on_a_connection_that_is_lost_in_silence_fails_in_time_and_the_next_one_works(
    tmp_path: Path, databases: PostgresDatabases
) -> None:
    """Else clients wait 30 s for each connection of the pool."""
    url = await asyncio.to_thread(databases.with_tables)
    async with (
        cut_point(port_of(url)) as point,
        open_cluster_storage(at(url, point), key_file=tmp_path / "key") as behind,
    ):
        await behind.events.append([event(1)])
        point.lose()
        async with asyncio.timeout(READS_ON_S):
            with pytest.raises(StorageError):
                await behind.events.last_seq()
            assert await behind.events.last_seq() == 1


async def test_what_is_asked_while_answers_are_finished_is_not_begun(nats: NatsServer) -> None:
    begun: list[bytes] = []
    may_end = asyncio.Event()

    async def slowly(message: bytes) -> bytes:
        begun.append(message)
        await may_end.wait()
        return message

    settings = BusSettings(servers=(nats.url,), name="test")
    async with open_bus(settings) as bus, open_bus(settings) as other:

        async def answer() -> None:
            async with other.answering("waydrop.x", slowly):
                await is_begun.wait()

        is_begun = asyncio.Event()
        answering = asyncio.create_task(answer())
        first = asyncio.create_task(asked(bus, b"first"))
        await until(lambda: asyncio.sleep(0, begun), bool, "it is asked", SOON_S)
        is_begun.set()  # the block ends, once this is answered
        # what is sent in the moment in which it unsubscribes is told as unknown
        await until(lambda: told_of(bus, b"more"), lambda told: told == "nobody answers", "nobody begins it", SOON_S)
        assert begun == [b"first"], "nothing is begun by who ends"
        may_end.set()
        assert await first == b"first", "and what was begun is answered"
        await answering


async def told_of(bus: Bus, message: bytes) -> str:
    """How a request ends of which nothing may be begun."""
    try:
        await bus.request("waydrop.x", message, timeout_s=0.5)
    except GatewayUnreachableError:
        return "nobody answers"
    except NoReplyError:
        return "it may have been carried out"
    return "it was carried out"


async def asked(bus: Bus, message: bytes) -> bytes:
    """The answer, as soon as somebody answers."""
    while True:
        try:
            return await bus.request("waydrop.x", message, timeout_s=SOON_S)
        except (BusDownError, GatewayUnreachableError):
            await asyncio.sleep(0.05)
