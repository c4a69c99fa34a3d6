"""A cluster in memory: a bus that loses what a test wants lost, and a store of gateways' events."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Mapping, Sequence
from contextlib import asynccontextmanager, suppress

from app.domain.cluster.envelope import Envelope, RelayedEvent
from app.domain.cluster.errors import BusDownError, GatewayUnreachableError, LeaseMovedError, NoReplyError
from app.domain.cluster.lease import Leaseholder
from app.domain.cluster.ports import Answering, Hearing, LeftRun
from app.domain.errors import NotFoundError, StorageError
from app.domain.events import Event, NewEvent
from app.domain.events.event import JournalHead
from app.domain.ports.stores import JobRecord, StoredAnswer, StoredPlan
from app.domain.run.run import Run
from tests.support.fakes import MemoryEventStore


class MemoryReceived:
    """A message of MemoryBus."""

    def __init__(self, bus: MemoryBus, message: bytes) -> None:
        self.message = message
        self._bus = bus

    async def confirm(self) -> None:
        """See ReceivedEnvelope."""

    async def postpone(self, delay_s: float) -> None:
        """See ReceivedEnvelope; at once."""
        await self._bus.kept.put(self.message)


class MemoryBus:
    """Bus in one process. `loses` chooses envelopes that are acknowledged and lost; `down` refuses everything."""

    def __init__(self) -> None:
        self.kept: asyncio.Queue[bytes] = asyncio.Queue(10_000)
        self.loses: Callable[[Envelope], bool] = lambda envelope: False
        self.changes: Callable[[Envelope], Envelope] = lambda envelope: envelope
        self.down = False
        self.loses_written = 0
        self.before_refusal: Callable[[], None] = lambda: None
        self.published: list[str] = []
        self.asked: list[str] = []
        self._answering: dict[str, Answering] = {}
        self._hearing: list[tuple[str, Hearing]] = []
        self._leases: dict[str, tuple[bytes, int]] = {}
        self._revision = 0

    def expire(self, site: str) -> None:
        """The lease was not renewed in time."""
        self._leases.pop(site, None)

    async def read_lease(self, site: str) -> tuple[bytes, int]:
        """See Bus."""
        self._refuse_if_down()
        return self._leases.get(site, (b"", 0))

    async def write_lease(self, site: str, lease: bytes, *, after: int) -> int:
        """See Bus."""
        self._refuse_if_down()
        if self._leases.get(site, (b"", 0))[1] != after:
            raise LeaseMovedError("moved")
        self._revision += 1
        self._leases[site] = (lease, self._revision)
        if self.loses_written:
            self.loses_written -= 1
            raise BusDownError("the answer was lost")
        return self._revision

    async def publish_envelope(self, envelope: Envelope) -> None:
        """See Bus."""
        self._refuse_if_down()
        self.published.append(envelope.message_id)
        if not self.loses(envelope):
            await self.kept.put(self.changes(envelope).to_json())

    @asynccontextmanager
    async def envelopes(self) -> AsyncIterator[MemoryBus]:
        """See Bus."""
        self._refuse_if_down()
        yield self

    async def next(self, *, most: int, timeout_s: float) -> Sequence[MemoryReceived]:
        """See EnvelopeFeed. A test does not wait as long as NATS."""
        self._refuse_if_down()
        with suppress(TimeoutError):
            async with asyncio.timeout(0.01):
                return [MemoryReceived(self, await self.kept.get())]
        return []

    async def request(self, subject: str, message: bytes, *, timeout_s: float) -> bytes:
        """See Bus."""
        self._refuse_if_down()
        self.asked.append(subject)
        if subject not in self._answering:
            raise GatewayUnreachableError(f"nobody answers {subject}")
        if not (answer := await self._answering[subject](message)):
            raise NoReplyError(f"no answer on {subject}")
        return answer

    @asynccontextmanager
    async def answering(self, subject: str, answer: Answering, *, in_queue_group: bool = False) -> AsyncIterator[None]:
        """See Bus."""
        self._answering[subject] = answer
        yield
        del self._answering[subject]

    async def publish(self, subject: str, message: bytes) -> None:
        """See Bus."""
        self._refuse_if_down()
        for wanted, hear in tuple(self._hearing):
            if wanted == subject or (wanted.endswith("*") and subject.startswith(wanted[:-1])):
                hear(message)

    @asynccontextmanager
    async def hearing(self, subject: str, hear: Hearing) -> AsyncIterator[None]:
        """See Bus."""
        self._hearing.append((subject, hear))
        yield
        self._hearing.remove((subject, hear))

    def _refuse_if_down(self) -> None:
        if self.down:
            self.before_refusal()
            raise BusDownError("down")


class MemoryProjectionStore:
    """ProjectionStore in lists; refuses a second event with the same gateway and seq, as PostgreSQL does."""

    def __init__(self) -> None:
        self.events: list[tuple[str, int]] = []
        self.runs: dict[str, str] = {}
        self.failures = 0
        self.storing = False
        self.may_store = asyncio.Event()
        self.may_store.set()
        self._heads: dict[str, JournalHead] = {}
        self._lock = asyncio.Lock()

    @asynccontextmanager
    async def leading(self) -> AsyncIterator[MemoryProjectionStore]:
        """See ProjectionStore."""
        async with self._lock:
            yield self

    async def heads(self) -> Mapping[str, JournalHead]:
        """See ProjectionWriter."""
        return dict(self._heads)

    async def append(self, batch: Sequence[tuple[Envelope, Sequence[RelayedEvent]]]) -> None:
        """See ProjectionWriter."""
        self.storing = True
        await self.may_store.wait()
        self.storing = False
        if self.failures:
            self.failures -= 1
            raise StorageError("PostgreSQL is away")
        for envelope, events in batch:
            new = [(envelope.gateway, event.seq) for event in events]
            assert not set(new) & set(self.events), "an event is stored twice"
            self.events += new
            self._heads[envelope.gateway] = JournalHead(seq=events[-1].seq, hash=events[-1].hash)
            self.runs |= {str(row["id"]): str(row["state"]) for row in envelope.runs}

    async def check(self) -> None:
        """See ProjectionWriter."""


class MemoryClusterEvents(MemoryEventStore):
    """ClusterEvents in a list, of one gateway."""

    def __init__(self) -> None:
        super().__init__()
        self._changed = asyncio.Condition()

    async def append(
        self,
        events: Sequence[NewEvent],
        runs: Sequence[Run] = (),
        plans: Sequence[StoredPlan] = (),
        jobs: Sequence[JobRecord] = (),
        answers: Sequence[StoredAnswer] = (),
    ) -> Sequence[Event]:
        """See EventStore."""
        stored = await super().append(events, runs, plans, jobs, answers)
        async with self._changed:
            self._changed.notify_all()
        return stored

    async def seqs(self) -> Mapping[str, int]:
        """See ClusterEvents."""
        return {"gw-1": len(self.events)} if self.events else {}

    async def pages(self, after: int, limit: int) -> AsyncGenerator[Sequence[Event], None]:
        """See ClusterChanges."""
        while True:
            page = self.events[after : after + limit]
            after += len(page)
            yield page
            if not page:
                async with self._changed:
                    await self._changed.wait()


class NoHandover:
    """Handover without runs. `silent`: the links show that the other gateway commands nothing. `gate`: a takeover of a
    run waits for it.
    """

    def __init__(self) -> None:
        self.silent = False
        self.left: Sequence[LeftRun] = ()
        self.taken: list[str] = []
        self.is_answered = True
        self.lost = False
        self.looks = 0
        self.reclaimed: list[str] = []
        self.meanwhile: Callable[[], None] = lambda: None
        self.fails: dict[str, int] = {}
        self.gone: set[str] = set()
        self.gate = asyncio.Event()
        self.gate.set()

    def has_lost_a_vehicle(self) -> bool:
        """See Handover."""
        return self.lost

    def is_silent(self, holder: Leaseholder, left: Sequence[LeftRun], held_age_s: float) -> bool:
        """See Handover."""
        return self.silent

    async def runs_left(self) -> Sequence[LeftRun]:
        """See Handover."""
        self.looks += 1
        if not self.is_answered:
            raise GatewayUnreachableError("no API node")
        return self.left

    async def reclaim(self, of: str, left: Sequence[LeftRun]) -> None:
        """See Handover."""
        self.reclaimed.append(of)

    async def take_over(self, left: LeftRun) -> None:
        """See Handover."""
        await self.gate.wait()
        if left.run_id in self.gone:
            raise NotFoundError("no such run")
        if self.fails.get(left.run_id, 0):
            self.fails[left.run_id] -= 1
            raise StorageError("the disk is full")
        meanwhile, self.meanwhile = self.meanwhile, lambda: None
        meanwhile()
        self.taken.append(left.run_id)
