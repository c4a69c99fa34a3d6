"""Relay and projection with a real NATS and a real PostgreSQL, which die in the middle."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Iterator
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from pathlib import Path

import pytest

from app.cluster import BusSettings, open_bus
from app.domain.cluster.envelope import Envelope
from app.domain.cluster.errors import BusDownError, GatewayUnreachableError, NoReplyError
from app.domain.cluster.ports import ALL_STATES, Bus, GatewayReport, states_of
from app.domain.errors import StorageError
from app.domain.events import NewEvent
from app.domain.events.event import GENESIS, event_hash
from app.domain.events.run import RunCreated
from app.domain.run.run import Run, RunState, TakenOver
from app.services.clock import SystemClock
from app.services.handover import LeftRunCalls
from app.services.journal import Journal
from app.services.projection import Projection
from app.services.relay import Relay
from app.storage import Storage, open_storage
from app.storage.events import event_row
from app.storage.postgres import ClusterStorage, open_cluster_storage
from tests.support.certificates import write_certificate
from tests.support.cluster_servers import PostgresDatabases, held_port
from tests.support.service_process import until
from tests.support.stored_samples import event, plan, run
from tools.cluster_servers import NatsServer

SOON_S = 60.0


def settings(nats: NatsServer, name: str = "test") -> BusSettings:
    return BusSettings(servers=(nats.url,), name=name)


async def connected(bus: Bus) -> None:
    async with asyncio.timeout(SOON_S):
        while True:
            try:
                return await bus.publish("waydrop.test", b"")
            except BusDownError:
                await asyncio.sleep(0.05)


async def test_nobody_there_is_told_at_once_and_a_lost_answer_as_unknown(nats: NatsServer) -> None:
    async def echo(message: bytes) -> bytes:
        return b"heard " + message

    async def never(message: bytes) -> bytes:
        await asyncio.sleep(0.5)
        return b""

    async with open_bus(settings(nats)) as bus, open_bus(settings(nats)) as other:
        await connected(bus)
        await connected(other)
        with pytest.raises(GatewayUnreachableError, match=r"nobody answers waydrop\.x"):
            await bus.request("waydrop.x", b"", timeout_s=SOON_S)
        async with other.answering("waydrop.x", echo), other.answering("waydrop.y", never):
            await until(lambda: _asked(bus, "waydrop.x"), lambda reply: reply == b"heard you", "answered", SOON_S)
            with pytest.raises(NoReplyError, match="may have been carried out"):
                await bus.request("waydrop.y", b"", timeout_s=0.1)


async def test_what_ended_while_nats_was_away_answers_nothing_when_it_is_back(nats: NatsServer) -> None:
    async def echo(message: bytes) -> bytes:
        return message

    async with (
        open_bus(settings(nats)) as bus,
        open_bus(settings(nats)) as other,
        other.answering("waydrop.stays", echo),
        AsyncExitStack() as ends,
    ):
        await ends.enter_async_context(other.answering("waydrop.x", echo, in_queue_group=True))
        await connected(bus)
        await until(lambda: _asked(bus, "waydrop.x"), lambda reply: reply == b"you", "answered", SOON_S)
        await asyncio.to_thread(nats.kill)
        await until(lambda: _is_down(other), bool, "it knows that NATS is away", SOON_S)
        await ends.aclose()
        await asyncio.to_thread(nats.start)
        await connected(bus)
        await until(lambda: _asked(bus, "waydrop.stays"), lambda reply: reply == b"you", "it is back", SOON_S)
        with pytest.raises(GatewayUnreachableError):
            await bus.request("waydrop.x", b"you", timeout_s=SOON_S)


async def _is_down(bus: Bus) -> bool:
    try:
        await bus.publish("waydrop.test", b"")
    except BusDownError:
        return True
    return False


@pytest.mark.parametrize(("in_queue_group", "times"), [(True, 1), (False, 2)])
async def test_of_two_in_a_queue_group_one_carries_a_request_out(
    nats: NatsServer, *, in_queue_group: bool, times: int
) -> None:
    """Two API nodes may both believe that they write the cluster's store: a job that is ordered is made once."""
    carried_out: list[bytes] = []

    async def carry_out(message: bytes) -> bytes:
        carried_out.append(message)
        return message

    async with (
        open_bus(settings(nats)) as bus,
        open_bus(settings(nats)) as one,
        open_bus(settings(nats)) as other,
        one.answering("waydrop.x", carry_out, in_queue_group=in_queue_group),
        other.answering("waydrop.x", carry_out, in_queue_group=in_queue_group),
        one.answering("waydrop.one", carry_out),
        other.answering("waydrop.other", carry_out),
    ):
        await connected(bus)
        for subject in ("waydrop.one", "waydrop.other"):  # subscribed to last: both answer the other subject, too
            await until(lambda of=subject: _asked(bus, of), bool, "it answers", SOON_S)  # type: ignore[misc]
        carried_out.clear()
        wanted = [str(number).encode() for number in range(20)]
        for message in wanted:
            assert await bus.request("waydrop.x", message, timeout_s=SOON_S) == message
        await until(lambda: asyncio.sleep(0, len(carried_out)), lambda found: found >= 20 * times, "all are", SOON_S)
        assert sorted(carried_out) == sorted(wanted * times)


async def test_a_request_that_is_cancelled_as_its_answer_comes_is_cancelled(nats: NatsServer) -> None:
    """Else whoever asks in a loop never ends: a service would wait for its relay for ever."""

    async def echo(message: bytes) -> bytes:
        return message

    async with open_bus(settings(nats)) as bus:
        await connected(bus)
        async with bus.answering("waydrop.x", echo):
            await until(lambda: _asked(bus, "waydrop.x"), lambda reply: reply == b"you", "answered", SOON_S)
            for steps in [*range(60)] * 5:  # of the loop, until it is cancelled: some end as the answer arrives
                request = asyncio.create_task(bus.request("waydrop.x", b"", timeout_s=SOON_S))
                for _ in range(steps):
                    await asyncio.sleep(0)
                cancelled = request.cancel()
                await asyncio.wait([request])
                assert request.cancelled() == cancelled, f"after {steps} steps"


async def _asked(bus: Bus, subject: str) -> bytes:
    try:
        return await bus.request(subject, b"you", timeout_s=SOON_S)
    except GatewayUnreachableError:
        return b""


@pytest.fixture
def port() -> Iterator[int]:
    """A port that nobody else is given before the server takes it."""
    with held_port() as held:
        yield held


async def test_a_bus_waits_for_its_server_and_refuses_meanwhile(tmp_path: Path, port: int) -> None:
    server = NatsServer(tmp_path / "nats", port)
    heard: list[bytes] = []
    async with open_bus(settings(server)) as bus, bus.hearing("waydrop.test", heard.append):
        with pytest.raises(BusDownError, match="NATS is not connected"):
            await bus.publish("waydrop.test", b"lost")
        await asyncio.to_thread(server.start)
        try:
            await connected(bus)
            await until(lambda: _told(bus, heard), lambda found: b"now" in found, "heard", SOON_S)
            assert b"lost" not in heard
        finally:
            await asyncio.to_thread(server.kill)


async def _told(bus: Bus, heard: list[bytes]) -> list[bytes]:
    await bus.publish("waydrop.test", b"now")
    return heard


@asynccontextmanager
async def gateway(folder: Path, bus: Bus) -> AsyncIterator[tuple[Storage, Journal]]:
    """A gateway's journal and relay, with its reports."""
    async with open_storage(folder / "journal.db") as storage:
        journal = Journal(storage.events, SystemClock())
        await journal.start()
        relay = Relay("north", storage.gateway_id, storage.relay_log, journal, bus)
        await relay.start()
        reporting = asyncio.create_task(report(bus, storage.gateway_id, journal))
        try:
            yield storage, journal
        finally:
            reporting.cancel()
            await asyncio.gather(reporting, return_exceptions=True)
            await relay.close()
            await journal.close()


async def report(bus: Bus, gateway_id: str, journal: Journal) -> None:
    while True:
        told = GatewayReport(gateway=gateway_id, site="north", seq=journal.last_seq)
        with suppress(BusDownError):
            await bus.publish(states_of("north"), told.model_dump_json().encode())
        await asyncio.sleep(0.2)


async def stored(cluster: ClusterStorage) -> list[int]:
    """The seqs in the store, by position. Empty while PostgreSQL is away."""
    try:
        return [event.seq for event in await cluster.events.read(after=0, limit=10_000)]
    except StorageError:
        return []


async def test_nats_that_loses_its_store_and_postgres_that_crashes_lose_and_double_nothing(
    tmp_path: Path, nats: NatsServer, databases: PostgresDatabases
) -> None:
    url = await asyncio.to_thread(databases.with_tables)
    async with (
        open_bus(settings(nats, "gateway")) as at_gateway,
        open_bus(settings(nats, "api")) as at_node,
        open_cluster_storage(url, key_file=tmp_path / "key") as cluster,
        gateway(tmp_path, at_gateway) as (storage, journal),
        AsyncExitStack() as hearing,
    ):
        projection = Projection(cluster.projection, at_node, SystemClock())
        projection.start()
        await hearing.enter_async_context(
            at_node.hearing(ALL_STATES, lambda told: projection.hear(GatewayReport.model_validate_json(told)))
        )
        enough = asyncio.Event()
        recording = asyncio.create_task(record(journal, enough))
        try:
            await until(lambda: stored(cluster), lambda seqs: len(seqs) > 50, "events must arrive", SOON_S)
            await asyncio.to_thread(nats.kill)
            await asyncio.to_thread(nats.lose_store)
            await asyncio.to_thread(nats.start)
            before = journal.last_seq
            await until(lambda: stored(cluster), lambda seqs: len(seqs) > before, "after the loss", SOON_S)
            try:
                await asyncio.to_thread(databases.server.stop_immediately)
            finally:  # other files have it, too
                await asyncio.to_thread(databases.server.start)
            before = journal.last_seq
            await until(lambda: stored(cluster), lambda seqs: len(seqs) > before, "after the crash", SOON_S)
        finally:
            enough.set()
            await recording
        last = journal.last_seq
        await until(lambda: stored(cluster), lambda seqs: len(seqs) >= last, "all must arrive", SOON_S)
        assert await stored(cluster) == list(range(1, last + 1))
        assert [one.hash for one in await cluster.events.read(after=0, limit=10_000)] == [
            one.hash for one in await storage.events.read(after=0, limit=10_000)
        ]
        assert (await cluster.runs.get("run-1")) is not None
        await projection.close()


async def record(journal: Journal, enough: asyncio.Event) -> None:
    await journal.record(event(0), plans=(plan(),))
    while not enough.is_set():
        await journal.record(event(1, "run-1"), runs=(run(),))
        await asyncio.sleep(0.03)  # in five minutes fewer than are read at once


def envelope(gateway_id: str, first: int, count: int, *, as_of: int = 0, state: RunState | None = None) -> Envelope:
    """Events without a run, and a run in a state."""
    rows, previous = [], GENESIS
    for seq in range(1, first + count):
        row = event_row(event(seq))
        previous = event_hash(previous, gateway=gateway_id, seq=seq, **row)
        rows.append({**row, "seq": seq, "hash": previous})
    runs = [] if state is None else [_row_of(state)]
    return Envelope.model_validate(
        {"site": "north", "gateway": gateway_id, "as_of": as_of, "events": rows[first - 1 :], "runs": runs}
    )


def _row_of(state: RunState) -> dict[str, object]:
    told = run(state=state)
    columns = {"id": told.id, "plan_id": told.plan_id, "vehicle_id": told.vehicle_id, "is_over": False}
    return columns | {"state": state.value, "created_at": 1.0, "document": told.model_dump_json()}


@pytest.mark.parametrize("at_once", [False, True])
async def test_an_event_is_never_stored_twice_and_an_older_run_never_replaces_a_newer_one(
    tmp_path: Path, databases: PostgresDatabases, at_once: bool
) -> None:
    url = await asyncio.to_thread(databases.with_tables)
    async with open_cluster_storage(url, key_file=tmp_path / "key") as cluster:
        async with cluster.projection.leading() as writer:
            newer = envelope("gw-1", 1, 3, as_of=9, state=RunState.UPLOADED)
            older = envelope("gw-1", 4, 1, as_of=5, state=RunState.CREATED)
            both = [(newer, newer.events), (older, older.events)]
            for batch in [both] if at_once else [both[:1], both[1:]]:
                await writer.append(batch)
            assert (await writer.heads())["gw-1"].seq == 4
        with pytest.raises(StorageError):
            async with cluster.projection.leading() as writer:
                await writer.append([(newer, newer.events)])
        assert await stored(cluster) == [1, 2, 3, 4]
        found = await cluster.runs.get("run-1")
        assert found is not None
        assert found.state is RunState.UPLOADED


def of_run(gateway_id: str, told: Run) -> Envelope:
    """The first event of a gateway, which has the run."""
    row = event_row(NewEvent.of(RunCreated(told), 1000.0, vehicle_id=told.vehicle_id, run_id=told.id))
    hashed = event_hash(GENESIS, gateway=gateway_id, seq=1, **row)
    columns = {"id": told.id, "plan_id": told.plan_id, "vehicle_id": told.vehicle_id, "is_over": told.is_over}
    document = columns | {"state": told.state.value, "created_at": 1.0, "document": told.model_dump_json()}
    events = [{**row, "seq": 1, "hash": hashed}]
    return Envelope.model_validate(
        {"site": "north", "gateway": gateway_id, "as_of": 1, "events": events, "runs": [document]}
    )


async def test_a_gateway_that_lost_a_run_to_another_one_says_nothing_of_it_any_more(
    tmp_path: Path, databases: PostgresDatabases
) -> None:
    url = await asyncio.to_thread(databases.with_tables)
    taken = TakenOver(gateway="gw-2", from_gateway="gw-1", number=1, at=1.0)
    first = run(vehicle_id="north-v1", state=RunState.FLYING)
    async with open_cluster_storage(url, key_file=tmp_path / "key") as cluster:
        left = LeftRunCalls(cluster.runs, cluster.plans, cluster.events)
        async with cluster.projection.leading() as writer:

            async def told(gateway_id: str, one: Run) -> None:
                envelope = of_run(gateway_id, one)
                heads = await writer.heads()
                await writer.append([(envelope, () if gateway_id in heads else envelope.events)])

            await told("gw-1", first)
            assert [one.gateway for one in await left.left_runs("north", "gw-2", [])] == ["gw-1"]
            assert await left.left_runs("north", "gw-1", ["run-1"]) == [], "its own"
            assert await left.left_runs("south", "gw-2", []) == [], "of another site"
            await told("gw-2", first.model_copy(update={"taken_over": taken, "state": RunState.RETURNING}))
            await told("gw-1", first.model_copy(update={"state": RunState.LOST}))
            found = await cluster.runs.get("run-1")
            assert found is not None
            assert found.state is RunState.RETURNING
            await told("gw-2", found.model_copy(update={"state": RunState.COMPLETED}))
            assert await left.left_runs("north", "gw-1", []) == [], "it is over"
            (ended,) = await left.left_runs("north", "gw-1", ["run-1"])
            assert (await left.left_run("run-1")).run.state is RunState.COMPLETED
            assert (ended.gateway, ended.is_over) == ("gw-2", True), "and its first gateway learns that"


@pytest.mark.parametrize("order", [("gw-1", "gw-2"), ("gw-2", "gw-1")])
async def test_of_two_gateways_that_tell_of_a_run_at_once_the_one_that_took_it_over_counts(
    tmp_path: Path, databases: PostgresDatabases, order: tuple[str, str]
) -> None:
    url = await asyncio.to_thread(databases.with_tables)
    taken = TakenOver(gateway="gw-2", from_gateway="gw-1", number=1, at=1.0)
    first = run(vehicle_id="north-v1", state=RunState.FLYING)
    told = {
        "gw-1": of_run("gw-1", first.model_copy(update={"state": RunState.LOST})),
        "gw-2": of_run("gw-2", first.model_copy(update={"taken_over": taken, "state": RunState.RETURNING})),
    }
    async with open_cluster_storage(url, key_file=tmp_path / "key") as cluster:
        async with cluster.projection.leading() as writer:
            await writer.append([(told[gateway_id], told[gateway_id].events) for gateway_id in order])
        found = await cluster.runs.get("run-1")
        assert found is not None
        assert found.state is RunState.RETURNING
        assert await stored(cluster) == [1, 1]


async def test_positions_have_no_gaps_and_are_visible_in_their_order(
    tmp_path: Path, databases: PostgresDatabases
) -> None:
    url = await asyncio.to_thread(databases.with_tables)
    seen: list[int] = []

    async with open_cluster_storage(url, key_file=tmp_path / "key") as cluster:

        async def read_along() -> None:
            async for page in cluster.events.pages(0, 7):
                seen.extend(one.position for one in page)

        async def relayed() -> None:
            async with cluster.projection.leading() as writer:
                for seq in range(1, 41):
                    one = envelope("gw-1", seq, 1)
                    await writer.append([(one, one.events)])

        async def own() -> None:
            for number in range(20):
                await cluster.events.append([event(number), event(number)])

        reading = asyncio.create_task(read_along())
        await asyncio.gather(relayed(), own(), own())
        await until(lambda: asyncio.sleep(0, seen), lambda found: len(found) >= 120, "all must be seen", SOON_S)
        reading.cancel()
        await asyncio.gather(reading, return_exceptions=True)
    assert seen == list(range(1, 121))


async def test_one_process_writes_and_its_end_lets_the_next_one(tmp_path: Path, databases: PostgresDatabases) -> None:
    url = await asyncio.to_thread(databases.with_tables)
    async with (
        open_cluster_storage(url, key_file=tmp_path / "key") as one,
        open_cluster_storage(url, key_file=tmp_path / "key") as other,
    ):

        async def lead() -> str:
            async with other.projection.leading():
                return "leads"

        async with one.projection.leading():
            waiting = asyncio.create_task(lead())
            done, _ = await asyncio.wait({waiting}, timeout=1.0)
            assert not done
        async with asyncio.timeout(SOON_S):
            assert await waiting == "leads"


GATEWAY_USER = {
    "publish": [
        "waydrop.events.north",
        "waydrop.states.north",
        "waydrop.cursors",
        "waydrop.runs",
        "$KV.WAYDROP_LEASES.north",
        "$JS.API.DIRECT.GET.KV_WAYDROP_LEASES.$KV.WAYDROP_LEASES.north",
    ],
    "subscribe": ["waydrop.pages.north.*", "waydrop.calls.north", "waydrop.targets", "_INBOX.>"],
}


async def test_a_gateway_s_user_publishes_for_its_own_site_alone_and_over_tls(tmp_path: Path, port: int) -> None:
    certificate, key = write_certificate(tmp_path)
    users = [
        {"user": "api", "password": "api", "permissions": {"publish": ">", "subscribe": ">"}},
        {"user": "north", "password": "north", "permissions": {**GATEWAY_USER, "allow_responses": True}},
    ]
    config = {"tls": {"cert_file": str(certificate), "key_file": str(key)}, "authorization": {"users": users}}
    (tmp_path / "nats.conf").write_text(json.dumps(config))
    server = NatsServer(tmp_path / "nats", port, tmp_path / "nats.conf")
    await asyncio.to_thread(server.start)

    def as_user(name: str) -> BusSettings:
        return BusSettings(servers=(f"tls://{name}:{name}@localhost:{server.port}",), name=name, ca=certificate)

    async def answer(message: bytes) -> bytes:
        return b"done"

    heard: list[bytes] = []
    try:
        async with (
            open_bus(as_user("api")) as api,
            open_bus(as_user("north")) as north,
            api.hearing("waydrop.states.*", heard.append),
            north.answering("waydrop.calls.north", answer),
        ):
            await connected(api)
            await until(lambda: _reached(api, "waydrop.calls.north"), lambda reply: reply == b"done", "calls", SOON_S)
            await north.publish("waydrop.states.south", b"forged")
            async with api.envelopes() as feed:
                forged = envelope("gw-1", 1, 1).model_copy(update={"site": "south"})
                with pytest.raises(BusDownError):
                    await north.publish_envelope(forged)
                await north.publish_envelope(envelope("gw-1", 1, 1))
                (received,) = await feed.next(most=10, timeout_s=SOON_S)
                assert received.message == envelope("gw-1", 1, 1).to_json()
                revision = await north.write_lease("north", b"gw-1", after=0)
                assert await north.read_lease("north") == (b"gw-1", revision)
            await north.publish("waydrop.states.north", b"own")
            await until(lambda: asyncio.sleep(0, heard), lambda found: b"own" in found, "its own is heard", SOON_S)
            assert heard == [b"own"]
    finally:
        await asyncio.to_thread(server.kill)


async def _reached(bus: Bus, subject: str) -> bytes:
    try:
        return await bus.request(subject, b"", timeout_s=1.0)
    except (GatewayUnreachableError, NoReplyError, BusDownError):
        return b""
