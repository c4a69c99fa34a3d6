"""The ports to storage: what is stored, and what each store returns. storage/ implements them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol, TypeVar

from app.domain.events import Event, NewEvent
from app.domain.events.service import JournalPruned, PrunedChain
from app.domain.jobs.job import Job, JobState
from app.domain.jobs.queue import VehicleQueue
from app.domain.run.attachment import Attachment
from app.domain.run.run import Run, RunState
from app.domain.vehicle.state import VehicleType

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class RunFilter:
    """All given conditions must match; without any: all runs.

    An empty `states` matches any state. Times are Unix seconds of the run's creation, `created_from` inclusive and
    `created_before` exclusive. `older_than` is the ID of a run: only runs stored before it, for the next page.
    """

    vehicle_id: str | None = None
    plan_id: str | None = None
    states: frozenset[RunState] = frozenset()
    open_only: bool = False
    created_from: float | None = None
    created_before: float | None = None
    older_than: str | None = None


ALL_RUNS: Final = RunFilter()


class AttachmentStore(Protocol):
    """Files by their SHA-256, and what the journal says of them. Each method may raise StorageError."""

    async def put(self, sha256: str, content: bytes) -> None:
        """Store a file, whole or not at all; on the disk when this returns. One that is there already is left.

        Raises AttachmentQuotaError.
        """

    async def get(self, sha256: str) -> bytes:
        """The file. Raises AttachmentAlteredError if it is gone or has another hash."""

    async def is_intact(self, sha256: str) -> bool:
        """Whether the file is there and has this hash."""

    async def of_run(self, run_id: str) -> Sequence[Attachment]:
        """What the journal's events say was attached to a run, in order."""


MOST_BYTES: Final = 8_000_000
"""Of one run, packed: some hours of flight. What comes after is left out."""
MOST_RUNS: Final = 100
"""The newest runs whose inputs are kept."""


class FlightLog(Protocol):
    """Lines of domain/flight/recording.py. Not part of the chain: they explain a run, and are no evidence of it."""

    async def append(self, run_id: str, text: str) -> None:
        """Keep some more lines of a run, unless it has MOST_BYTES. Raises StorageError."""

    async def read(self, run_id: str) -> str:
        """All lines of a run in order; empty if there are none. Raises StorageError."""


JobRecord = Job | VehicleQueue
"""What an event of jobs may change."""


@dataclass(frozen=True, slots=True)
class JobFilter:
    """All given conditions must match. `vehicle_id`: the vehicle that is or was assigned, or that the job names.

    `older_than` is the ID of a job: only jobs stored before it, for the next page.
    """

    vehicle_id: str | None = None
    plan_id: str | None = None
    states: frozenset[JobState] = frozenset()
    open_only: bool = False
    older_than: str | None = None


ALL_JOBS: Final = JobFilter()


class JobStore(Protocol):
    """Jobs as last stored. Each method may raise StorageError."""

    async def get(self, job_id: str) -> Job | None:
        """One job."""

    async def list_jobs(self, wanted: JobFilter, *, limit: int) -> Sequence[Job]:
        """Newest first."""

    async def list_queues(self) -> Sequence[VehicleQueue]:
        """The queues of which anything was ever recorded, by vehicle."""


@dataclass(frozen=True, slots=True)
class StoredAnswer:
    """The answer to a request with an Idempotency-Key, replayed for the same key and the same request."""

    key: str
    request_hash: str
    status: int
    headers: dict[str, str]
    body: bytes


AnswerTo = Callable[[T], StoredAnswer]
"""The answer to a request that creates something, made of what was created and stored in the same commit."""


class EventStore(Protocol):
    """The journal on disk. One writer."""

    async def append(
        self,
        events: Sequence[NewEvent],
        runs: Sequence[Run] = (),
        plans: Sequence[StoredPlan] = (),
        jobs: Sequence[JobRecord] = (),
        answers: Sequence[StoredAnswer] = (),
    ) -> Sequence[Event]:
        """Number and store events, the runs and jobs they changed, the plans they announce, and the answers to the
        requests for that. Raises StorageError.
        """

    async def read(self, *, after: int, limit: int, run_id: str | None = None) -> Sequence[Event]:
        """Events with seq > after, in order, at most `limit`."""

    async def newest_accepted(self, *, before: int | None, limit: int) -> Sequence[Event]:
        """Events of the kind request.accepted with seq < `before`, newest first."""

    async def last_seq(self) -> int:
        """The highest seq stored; 0 if none."""

    async def last_offboard(self) -> Sequence[Event]:
        """The newest offboard.lease, offboard.changed and tasks.changed of each vehicle, in order."""

    async def last_pruned(self) -> JournalPruned | None:
        """What the newest journal.pruned of this journal says."""


@dataclass(frozen=True, slots=True)
class PrunedTo:
    """What is to be deleted: events up to a position, after which the chains go on from `chains`."""

    up_to: int
    chains: tuple[PrunedChain, ...]


class RetentionStore(Protocol):
    """Deletes what is old. Each method may raise StorageError."""

    async def oldest_open(self) -> tuple[str, float] | None:
        """The oldest run or job that is not over, and when it was created: it keeps all later events."""

    async def first_younger(self, *, before: float) -> tuple[int, float] | None:
        """Position and time of the first event that is not older than `before`: it keeps all later ones, too."""

    async def prunable(self, *, before: float, up_to: int) -> PrunedTo | None:
        """The events older than `before`, and at most up to the position `up_to`; None if there are none.

        It ends before the first event of a run or job that is not over.
        """

    async def prune(self, pruned: JournalPruned) -> bool:
        """Delete some of the events up to `pruned.up_to`, and the runs and jobs that end with them.

        False if all are gone. The event must be stored already.
        """

    async def delete_plans(self, *, before: float, spared: Sequence[str]) -> bool:
        """Delete some of the plans that are older than `before` and than the oldest event, and that nothing uses.

        False if there were none. `before` must be that of a stored journal.pruned.
        """

    async def has_attachments(self, *, before: float) -> bool:
        """Whether there are files whose newest attachment is older than `before`."""

    async def delete_attachments(self, *, before: float) -> None:
        """Delete them."""


class RunStore(Protocol):
    """Runs as last stored."""

    async def get(self, run_id: str) -> Run | None:
        """One run."""

    async def list_runs(self, wanted: RunFilter, *, limit: int) -> Sequence[Run]:
        """Newest first."""

    async def open_states(self) -> Mapping[RunState, int]:
        """How many runs have not ended, by state."""


@dataclass(frozen=True, slots=True)
class StoredPlan:
    """A plan as accepted. `document` is the normalised JSON; `hash` its sha256."""

    id: str
    hash: str
    name: str
    vehicle_type: VehicleType
    created_at: float
    created_by: str
    document: dict[str, Any]


class PlanStore(Protocol):
    """Accepted plans; never changed after they are stored (with their event: EventStore.append)."""

    async def get(self, plan_id: str) -> StoredPlan | None:
        """One plan."""

    async def list_plans(self, *, limit: int, older_than: str | None = None) -> Sequence[StoredPlan]:
        """Newest first. `older_than`: only plans stored before the one with this ID, for the next page."""


@dataclass(frozen=True, slots=True)
class StoredToken:
    """A bearer token: only its sha256 is kept. Times are Unix seconds; `expires_at` None: it does not expire.

    `last_used_at` is exact to a minute.
    """

    id: str
    name: str
    role: str
    token_hash: str
    created_at: float
    revoked_at: float | None = None
    expires_at: float | None = None
    last_used_at: float | None = None


class TokenStore(Protocol):
    """Bearer tokens."""

    async def add(self, token: StoredToken) -> None:
        """Store a new token."""

    async def find_by_hash(self, token_hash: str) -> StoredToken | None:
        """The live token with this hash; None if unknown or revoked."""

    async def list_tokens(self) -> Sequence[StoredToken]:
        """All, revoked ones too."""

    async def revoke(self, token_id: str, *, now: float) -> bool:
        """Revoke; False if there is no such live token."""

    async def touch(self, token_id: str, *, now: float) -> None:
        """Store that it was used."""


class ClaimStore(Protocol):
    """Requests with an Idempotency-Key that were begun, on any API node of a cluster; dropped after a day, as answers.

    Its store tells how old they are, not the clock of a node, which may jump.
    """

    async def claim(self, key: str) -> bool:
        """Whether nobody has begun a request with this key. Raises StorageError."""

    async def release(self, key: str) -> None:
        """The request did nothing: it may be begun again. Raises StorageError."""


class AnswerStore(Protocol):
    """Answers by Idempotency-Key; old ones are dropped after a day, whatever the time of day does meanwhile."""

    async def get(self, key: str) -> StoredAnswer | None:
        """The stored answer."""

    async def put(self, answer: StoredAnswer, *, replaces: bool = False) -> None:
        """Store an answer. The first one of a key is kept, unless this one replaces it. Raises StorageError."""

    async def forget(self, key: str) -> None:
        """Delete an answer that was stored for a request that was refused after all. Raises StorageError."""
