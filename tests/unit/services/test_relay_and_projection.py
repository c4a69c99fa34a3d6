"""What a gateway's journal stores is in the cluster's store once, in order, whatever is lost on the way."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

import pytest

from app.domain.cluster.envelope import Envelope
from app.domain.cluster.errors import NoReplyError
from app.domain.cluster.ports import ALL_STATES, GatewayReport, ProjectionWriter, pages_of, states_of
from app.domain.run.run import RunState
from app.services.clock import SystemClock
from app.services.journal import Journal
from app.services.projection import PAGE_TIMEOUT_S, Also, Projection
from app.services.relay import Relay
from app.storage import Storage, open_storage
from tests.support.memory_cluster import MemoryBus, MemoryProjectionStore
from tests.support.stored_samples import event, plan, run

SOON_S = 20.0


@dataclass
class Gateway:
    """A gateway's journal and its relay."""

    storage: Storage
    journal: Journal
    relay: Relay
    bus: MemoryBus

    async def report(self) -> None:
        told = GatewayReport(gateway=self.storage.gateway_id, site="north", seq=self.journal.last_seq)
        await self.bus.publish(states_of("north"), told.model_dump_json().encode())


@asynccontextmanager
async def gateway(folder: Path, bus: MemoryBus) -> AsyncIterator[Gateway]:
    async with open_storage(folder / "journal.db") as storage:
        journal = Journal(storage.events, SystemClock())
        await journal.start()
        relay = Relay("north", storage.gateway_id, storage.relay_log, journal, bus)
        await relay.start()
        try:
            yield Gateway(storage, journal, relay, bus)
        finally:
            await relay.close()
            await journal.close()


@asynccontextmanager
async def projection(
    store: MemoryProjectionStore, bus: MemoryBus, also: Also = nullcontext
) -> AsyncIterator[Projection]:
    projecting = Projection(store, bus, SystemClock(), also)
    projecting.start()
    try:
        async with bus.hearing(ALL_STATES, lambda told: projecting.hear(GatewayReport.model_validate_json(told))):
            yield projecting
    finally:
        await projecting.close()


async def until(holds: Callable[[], bool]) -> None:
    async with asyncio.timeout(SOON_S):
        while not holds():
            await asyncio.sleep(0.01)


@pytest.fixture(autouse=True)
def soon(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing here waits for a machine that is away."""
    monkeypatch.setattr("app.services.relay.RETRY_S", 0.01)
    monkeypatch.setattr("app.services.projection.RETRY_S", 0.01)
    monkeypatch.setattr("app.services.projection.LATE_S", 0.05)


def whole(store: MemoryProjectionStore, count: int) -> bool:
    return [seq for _, seq in store.events] == list(range(1, count + 1))


async def test_all_events_arrive_in_order_with_their_runs(tmp_path: Path) -> None:
    bus, store = MemoryBus(), MemoryProjectionStore()
    async with gateway(tmp_path, bus) as one, projection(store, bus):
        await one.journal.record(event(1), plans=(plan(),))
        await one.journal.record(event(2, "run-1"), runs=(run(),))
        await one.journal.record(event(3, "run-1"), event(4, "run-1"), runs=(run(state=RunState.UPLOADED),))
        await until(lambda: whole(store, 4))
        assert store.runs == {"run-1": "uploaded"}
        await until(lambda: one.relay.behind == 0)


async def test_what_was_recorded_while_nobody_stored_arrives_afterwards(tmp_path: Path) -> None:
    bus, store = MemoryBus(), MemoryProjectionStore()
    async with gateway(tmp_path, bus) as one:
        for number in range(700):
            await one.journal.record(event(number))
        assert one.relay.behind is None
        assert bus.published == []
        async with projection(store, bus):
            await until(lambda: whole(store, 700))


async def test_envelopes_that_are_acknowledged_and_lost_are_asked_for_again(tmp_path: Path) -> None:
    bus, store = MemoryBus(), MemoryProjectionStore()
    async with gateway(tmp_path, bus) as one, projection(store, bus):
        await one.journal.record(event(1))
        await until(lambda: whole(store, 1))
        bus.loses = lambda envelope: envelope.events[0].seq < 4
        await one.journal.record(event(2))
        await one.journal.record(event(3))
        await until(lambda: one.relay.behind == 0)  # lost, and not in one envelope with the event that shows the gap
        await one.journal.record(event(4))
        await until(lambda: whole(store, 4))
        assert bus.asked.count(pages_of("north", one.storage.gateway_id)) >= 1


async def test_a_gateway_is_told_of_no_event_that_is_not_stored_yet(tmp_path: Path) -> None:
    bus, store = MemoryBus(), MemoryProjectionStore()
    async with gateway(tmp_path, bus) as one, projection(store, bus):
        await one.journal.record(event(1))
        await until(lambda: whole(store, 1))
        store.may_store.clear()  # as PostgreSQL that is slow, and may fail
        await one.journal.record(event(2))
        await until(lambda: store.storing)
        assert await one.relay.stored() == 1
        store.may_store.set()
        await until(lambda: whole(store, 2))
        assert await one.relay.stored() == 2


async def test_of_two_gateways_with_one_site_each_is_asked_for_its_own_events(tmp_path: Path) -> None:
    bus, store = MemoryBus(), MemoryProjectionStore()
    bus.loses = lambda envelope: True
    (tmp_path / "second").mkdir()
    async with gateway(tmp_path, bus) as one, gateway(tmp_path / "second", bus) as other, projection(store, bus):
        for each in (one, other):
            await each.journal.record(event(1), event(2))
        await until(lambda: one.relay.behind == other.relay.behind == 0)
        for each in (one, other):
            await each.report()
        expected = {(each.storage.gateway_id, seq) for each in (one, other) for seq in (1, 2)}
        await until(lambda: set(store.events) == expected)


async def test_what_one_node_does_for_all_begins_once_it_has_stored_what_waited(tmp_path: Path) -> None:
    bus, store, found = MemoryBus(), MemoryProjectionStore(), list[int]()

    @asynccontextmanager
    async def also(writer: ProjectionWriter) -> AsyncIterator[None]:
        found.append(len(store.events))
        yield

    async with gateway(tmp_path, bus) as one:
        async with projection(store, bus):
            await one.journal.record(event(1))
            await until(lambda: whole(store, 1))
        for number in range(2, 6):
            await one.journal.record(event(number))
        await until(lambda: one.relay.behind == 0)
        async with projection(store, bus, also):
            await until(lambda: found != [])
    assert found == [5]


async def test_the_last_envelope_that_is_lost_is_missed_by_the_gateway_s_report(tmp_path: Path) -> None:
    bus, store = MemoryBus(), MemoryProjectionStore()
    async with gateway(tmp_path, bus) as one, projection(store, bus):
        bus.loses = lambda envelope: True
        await one.journal.record(event(1), event(2))
        await until(lambda: one.relay.behind == 0)
        await one.report()
        await until(lambda: whole(store, 2))


async def test_the_bus_away_costs_nothing(tmp_path: Path) -> None:
    bus, store = MemoryBus(), MemoryProjectionStore()
    async with gateway(tmp_path, bus) as one, projection(store, bus):
        await one.journal.record(event(1))
        await until(lambda: whole(store, 1))
        bus.down = True
        await one.journal.record(event(2), event(3))
        bus.down = False
        await until(lambda: whole(store, 3))


async def test_a_store_that_fails_gets_the_events_again(tmp_path: Path) -> None:
    bus, store = MemoryBus(), MemoryProjectionStore()
    async with gateway(tmp_path, bus) as one, projection(store, bus):
        store.failures = 3
        for number in range(5):
            await one.journal.record(event(number))
        await until(lambda: whole(store, 5))


async def test_a_store_that_fails_while_missing_events_are_asked_for_gets_them_again(tmp_path: Path) -> None:
    bus, store = MemoryBus(), MemoryProjectionStore()
    bus.loses = lambda envelope: envelope.events[0].seq == 1
    store.failures = 1
    async with gateway(tmp_path, bus) as one, projection(store, bus):
        await one.journal.record(event(0))
        await until(lambda: bool(bus.published))
        await one.journal.record(event(1))
        await until(lambda: whole(store, 2))


async def test_a_restarted_gateway_goes_on_after_what_is_stored(tmp_path: Path) -> None:
    bus, store = MemoryBus(), MemoryProjectionStore()
    async with projection(store, bus):
        for start in range(3):
            async with gateway(tmp_path, bus) as one:
                await one.journal.record(event(start))
                await until(lambda: len(store.events) == one.journal.last_seq)
        assert whole(store, 3)
        assert [name.partition(":")[2] for name in bus.published] == ["1-1", "2-2", "3-3"]


async def test_two_projections_store_nothing_twice_and_the_second_takes_over(tmp_path: Path) -> None:
    bus, store = MemoryBus(), MemoryProjectionStore()
    async with gateway(tmp_path, bus) as one, projection(store, bus) as first, projection(store, bus):
        await one.journal.record(event(1))
        await until(lambda: whole(store, 1))
        await first.close()
        await one.journal.record(event(2))
        await until(lambda: whole(store, 2))


async def test_altered_events_are_refused_and_named_and_the_gateway_s_own_are_stored(tmp_path: Path) -> None:
    bus, store = MemoryBus(), MemoryProjectionStore()

    def altered(envelope: Envelope) -> Envelope:
        forged = envelope.events[0].model_copy(update={"data": '{"forged":true}'})
        return envelope.model_copy(update={"events": (forged, *envelope.events[1:])})

    async with gateway(tmp_path, bus) as one, projection(store, bus) as projecting:
        await until(lambda: one.relay.behind == 0)
        bus.changes = altered
        await one.journal.record(event(1))
        await until(lambda: "does not follow" in projecting.broken.get(one.storage.gateway_id, ""))
        assert store.events == []
        await one.report()
        await until(lambda: whole(store, 1))
        assert not projecting.broken


async def test_garbage_on_the_bus_stops_nobody(tmp_path: Path) -> None:
    bus, store = MemoryBus(), MemoryProjectionStore()
    await bus.kept.put(b"garbage")
    async with gateway(tmp_path, bus) as one, projection(store, bus) as projecting:
        await one.journal.record(event(1))
        await until(lambda: whole(store, 1))
        assert projecting.why_not_ready() is None


async def test_a_page_larger_than_a_message_is_sent_in_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.services.relay.MOST_BYTES", 3000)
    bus, store = MemoryBus(), MemoryProjectionStore()
    async with gateway(tmp_path, bus) as one:
        await one.journal.record(*(event(number) for number in range(50)))
        async with projection(store, bus):
            await until(lambda: whole(store, 50))
    assert len(bus.published) >= 5


class DeadGateways(MemoryBus):
    """Gateways of the south: as with NATS before it notices, they are there, and their connections are dead."""

    def __init__(self) -> None:
        super().__init__()
        self.asked_of: list[str] = []

    async def request(self, subject: str, message: bytes, *, timeout_s: float) -> bytes:
        """See Bus."""
        if ".south" not in subject:
            return await super().request(subject, message, timeout_s=timeout_s)
        self.asked_of.append(subject)
        await asyncio.sleep(timeout_s)
        raise NoReplyError("no answer")

    async def report(self, number: int) -> None:
        told = GatewayReport(gateway=f"dead-{number}", site=f"south{number}", seq=5)
        await self.publish(states_of(told.site), told.model_dump_json().encode())


async def test_dead_gateways_that_are_late_hold_up_no_other(tmp_path: Path) -> None:
    bus, store = DeadGateways(), MemoryProjectionStore()
    async with gateway(tmp_path, bus) as one, projection(store, bus):
        await one.journal.record(event(1))
        await until(lambda: whole(store, 1))
        for number in range(3):
            await bus.report(number)
        await until(lambda: len(bus.asked_of) == 3)
        async with asyncio.timeout(PAGE_TIMEOUT_S / 2):
            for number in range(2, 30):
                await one.journal.record(event(number))
                await until(lambda: whole(store, one.journal.last_seq))
        assert len(bus.asked_of) == 3


async def test_an_envelope_of_a_dead_gateway_that_waits_for_others_holds_up_nobody(tmp_path: Path) -> None:
    bus, store = DeadGateways(), MemoryProjectionStore()
    async with gateway(tmp_path, bus) as one, projection(store, bus):
        await one.journal.record(event(1), event(2))
        await until(lambda: whole(store, 2))
        envelope = (await one.storage.relay_log.envelope("south", after=1, limit=1)).model_copy(
            update={"gateway": "dead-1"}
        )
        await bus.publish_envelope(envelope)
        await until(lambda: bus.asked_of != [])
        async with asyncio.timeout(PAGE_TIMEOUT_S / 2):
            await one.journal.record(event(3))
            await until(lambda: whole(store, 3))


async def test_a_gateway_that_does_not_answer_is_asked_less_and_less_and_not_at_all_once_it_is_silent(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.services.projection.PAGE_TIMEOUT_S", 0.0)
    monkeypatch.setattr("app.services.projection.SILENT_S", 0.2)
    bus, store = DeadGateways(), MemoryProjectionStore()
    async with projection(store, bus):
        for _ in range(75):
            await bus.report(1)
            await asyncio.sleep(0.02)
        assert 1 <= len(bus.asked_of) < 8, "after 0.05, 0.1, 0.2, 0.4, 0.8 s"
        await asyncio.sleep(0.3)
        asked = len(bus.asked_of)
        await asyncio.sleep(2.0)
        assert len(bus.asked_of) == asked


async def test_thousands_of_missing_events_are_asked_for_page_by_page(tmp_path: Path) -> None:
    bus, store = MemoryBus(), MemoryProjectionStore()
    bus.loses = lambda envelope: envelope.events[0].seq <= 4000
    async with gateway(tmp_path, bus) as one:
        for _ in range(9):
            await one.journal.record(*(event(number) for number in range(500)))
        async with projection(store, bus):
            await until(lambda: whole(store, 4500))
