"""The ports of a cluster: the gateways' relay, the store that is queried, and the messages between the parts."""

from __future__ import annotations

from collections.abc import AsyncGenerator, Awaitable, Callable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from typing import Final, Protocol

from pydantic import BaseModel

from app.domain.cluster.envelope import Envelope, RelayedEvent
from app.domain.cluster.lease import Leaseholder
from app.domain.events.event import Event, JournalHead
from app.domain.ports.stores import StoredPlan
from app.domain.run.run import Run

CURSORS: Final = "waydrop.cursors"
"""Which event of a gateway is the newest in the cluster's store: the projection answers."""
ALL_EVENTS: Final = "waydrop.events.*"
ALL_STATES: Final = "waydrop.states.*"


def events_of(site: str) -> str:
    """Envelopes of the site's relay."""
    return f"waydrop.events.{site}"


def pages_of(site: str, gateway: str) -> str:
    """Requests for events of a gateway that are missing in the cluster's store. Two gateways may have one site."""
    return f"waydrop.pages.{site}.{gateway}"


def calls_of(site: str) -> str:
    """Calls of API nodes to the site's gateway."""
    return f"waydrop.calls.{site}"


def states_of(site: str) -> str:
    """The newest states of the site's vehicles."""
    return f"waydrop.states.{site}"


LEFT_RUNS: Final = "waydrop.runs"
"""Which runs of a site another gateway follows: the node that writes the cluster's store answers."""
LEASES: Final = "WAYDROP_LEASES"
"""The bucket of the leases of sites."""


def lease_of(site: str) -> str:
    """The lease of the site's name."""
    return f"$KV.{LEASES}.{site}"


class EventsWanted(BaseModel):
    """A request for a page of the events of the gateway whose subject it is; the answer is an Envelope."""

    after: int
    limit: int


class GatewaySeq(BaseModel):
    """An event of a gateway. As a request to CURSORS it names the gateway; the answer has the newest stored seq."""

    gateway: str
    seq: int = 0


@dataclass(frozen=True, slots=True)
class GatewaySite:
    """Which gateway it is: the id of its journal, its site, and where it runs (see Leaseholder)."""

    gateway: str
    site: str
    address: str = ""


class LeftRun(BaseModel):
    """A run that another gateway, `gateway`, follows or followed last. `number`: see Run.handovers."""

    run_id: str
    vehicle_id: str
    gateway: str
    is_over: bool
    number: int = 0


class LeftRunDocuments(BaseModel):
    """The run as it is stored, and the plans that it flies."""

    run: Run
    plans: tuple[StoredPlan, ...]


class GatewayReport(GatewaySeq):
    """What a gateway reports of itself many times a second; `seq` is the newest event of its journal."""

    site: str


Answering = Callable[[bytes], Awaitable[bytes]]
Hearing = Callable[[bytes], None]


class RelayLog(Protocol):
    """The gateway's journal, as it is sent to the cluster."""

    async def envelope(self, site: str, *, after: int, limit: int) -> Envelope:
        """Events with seq > after, at most `limit`, with their documents. Raises StorageError."""


class ProjectionWriter(Protocol):
    """The right to write gateways' events into the cluster's store; one process has it at a time."""

    async def heads(self) -> Mapping[str, JournalHead]:
        """The newest stored event of each gateway. Raises StorageError."""

    async def append(self, batch: Sequence[tuple[Envelope, Sequence[RelayedEvent]]]) -> None:
        """Store new events with the documents of their envelopes, together or not at all.

        Raises:
            StorageError: they are not stored, or it is not known; read `heads` again.
        """

    async def check(self) -> None:
        """Ask the store whether this process still has the right. Raises StorageError: no, or there is no answer."""


class ProjectionStore(Protocol):
    """The cluster's store, for the projection."""

    def leading(self) -> AbstractAsyncContextManager[ProjectionWriter]:
        """Wait until no other process writes. Raises StorageError."""


class ReceivedEnvelope(Protocol):
    """A message of a gateway's relay. It comes again until it is confirmed."""

    @property
    def message(self) -> bytes: ...

    async def confirm(self) -> None:
        """It is stored, or of no use."""

    async def postpone(self, delay_s: float) -> None:
        """Let it come again later."""


class Bus(Protocol):
    """Messages between gateways and API nodes. Each method may raise BusDownError."""

    async def publish_envelope(self, envelope: Envelope) -> None:
        """Hand an envelope over to be kept until it is confirmed. It may be lost all the same."""

    def envelopes(self) -> AbstractAsyncContextManager[EnvelopeFeed]:
        """What relays have published and nobody has confirmed."""

    async def read_lease(self, site: str) -> tuple[bytes, int]:
        """The lease of a site and its revision; empty if nobody holds it."""

    async def write_lease(self, site: str, lease: bytes, *, after: int) -> int:
        """Write the lease for LEASE_TTL_S; empty: give it up. The revision that it has now.

        Raises:
            LeaseMovedError: its revision is not `after`, 0 for a lease that nobody holds.
        """

    async def request(self, subject: str, message: bytes, *, timeout_s: float) -> bytes:
        """Ask who answers `subject`.

        Raises:
            GatewayUnreachableError: nobody does; nothing was done.
            NoReplyError: somebody may have, and the answer was lost.
        """

    def answering(
        self, subject: str, answer: Answering, *, in_queue_group: bool = False
    ) -> AbstractAsyncContextManager[None]:
        """Answer requests, each in a task of its own, while the block runs. An empty answer is not sent.

        `in_queue_group`: of several that answer `subject` so, one gets a request; otherwise each gets it.
        """

    async def publish(self, subject: str, message: bytes) -> None:
        """Send to all who listen now. Nobody learns whether it arrived."""

    def hearing(self, subject: str, hear: Hearing) -> AbstractAsyncContextManager[None]:
        """Listen while the block runs."""


class EnvelopeFeed(Protocol):
    """Published envelopes, in order."""

    async def next(self, *, most: int, timeout_s: float) -> Sequence[ReceivedEnvelope]:
        """Some; none if none come in time. Raises BusDownError."""


class Handover(Protocol):
    """How the runs of another gateway of the site get here."""

    def is_silent(self, holder: Leaseholder, left: Sequence[LeftRun], held_age_s: float) -> bool:
        """Whether the links show that the other gateway does not command vehicles any more. `held_age_s` ago it still
        had its lease.

        The vehicles of its open runs, and all others that are heard, count: each is heard, and the other's HEARTBEAT
        came over its link until then, and does not now.
        """

    def has_lost_a_vehicle(self) -> bool:
        """Whether a vehicle cannot be reached now: a standby may hear nothing of this gateway there, either."""

    async def runs_left(self) -> Sequence[LeftRun]:
        """The runs of this site that another gateway follows, or has taken over from this one. Those that this one has
        taken over since are left out.

        Raises BusDownError; WaydropError: nobody says.
        """

    async def take_over(self, left: LeftRun) -> None:
        """Go on with one, once this gateway has the site. Raises WaydropError: try again later."""

    async def reclaim(self, of: str, left: Sequence[LeftRun]) -> None:
        """Another gateway (`of`, empty if it is not known) may have followed this one's own open runs: go on with those
        that are not in `left`, too, as with runs of another one. Raises StorageError.
        """


class ClusterChanges(Protocol):
    """Reports new events in the cluster's store."""

    def pages(self, after: int, limit: int) -> AsyncGenerator[Sequence[Event], None]:
        """All events after a position in order, those that are not stored yet as soon as they are: at most `limit` at
        once. A page may be empty, and the first one is if there is no such event. Raises StorageError.
        """
