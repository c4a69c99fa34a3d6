"""The envelope: some of a gateway's events in order, with their plans, runs and jobs.

Events travel as the gateway's journal has them, byte for byte, so that their hash chain can be verified anywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Final

from pydantic import BaseModel, Field, ValidationError

from app.domain.errors import InvalidInputError, WaydropError
from app.domain.events.event import JournalHead, event_hash
from app.domain.model import FrozenForm

ENVELOPE_VERSION: Final = 1

Row = dict[str, str | int | float | bool | None]
"""Columns of a stored document. `document` is its JSON text."""


class EnvelopeVersionError(InvalidInputError):
    """A gateway of a newer version sends what this version cannot read."""

    code = "cluster.envelope_version"


class MissingEventsError(WaydropError):
    """Events between the last known one and those of the envelope are missing: the gateway has them."""

    code = "cluster.events_missing"


class BrokenChainError(WaydropError):
    """An event does not follow from the one before it: it was altered, or two journals have one gateway id."""

    code = "cluster.chain_broken"


class RelayedEvent(FrozenForm):
    """An event as stored. `kind` may be one that this version does not know; `data` is JSON text."""

    seq: Annotated[int, Field(ge=1)]
    kind: str
    version: int
    time: float
    vehicle_id: str | None
    run_id: str | None
    data: str
    hash: str


class Envelope(FrozenForm):
    """`as_of` is the newest event of the journal when the documents were read: they are at least as new.

    `start` is the event that the first one follows, if it and all before it were deleted by age.
    """

    version: int = ENVELOPE_VERSION
    site: str
    gateway: str
    as_of: int
    events: tuple[RelayedEvent, ...]
    plans: tuple[Row, ...] = ()
    runs: tuple[Row, ...] = ()
    jobs: tuple[Row, ...] = ()
    queues: tuple[Row, ...] = ()
    start: JournalHead | None = None

    @property
    def message_id(self) -> str:
        """The same for the same events: NATS drops repeats by it."""
        return f"{self.gateway}:{self.events[0].seq}-{self.events[-1].seq}" if self.events else self.gateway

    def to_json(self) -> bytes:
        return self.model_dump_json().encode()

    @classmethod
    def from_json(cls, message: bytes) -> Envelope:
        """Read a message. Raises EnvelopeVersionError, InvalidInputError."""
        try:
            version = _Versioned.model_validate_json(message).version
            if version > ENVELOPE_VERSION:
                raise EnvelopeVersionError(
                    f"an envelope has version {version}, and this Waydrop reads up to {ENVELOPE_VERSION}",
                    hint="upgrade the API nodes before the gateways",
                )
            return cls.model_validate_json(message)
        except ValidationError as error:
            raise InvalidInputError(f"not an envelope: {error.errors()[0]['msg']}") from error


class _Versioned(BaseModel):
    version: int


def new_events(head: JournalHead, envelope: Envelope) -> Sequence[RelayedEvent]:
    """The events of the envelope after `head`, with every link of the chain verified. None: all are known.

    Events that the gateway has deleted by age are left out; what it says of its start is in its chain, too.

    Raises:
        MissingEventsError: the first of them is not the next one.
        BrokenChainError: one has another hash than its content and the hash before it give.
    """
    if envelope.start is not None and envelope.start.seq > head.seq:
        head = envelope.start
    events = [event for event in envelope.events if event.seq > head.seq]
    if events and events[0].seq != head.seq + 1:
        raise MissingEventsError(
            f"events {head.seq + 1} to {events[0].seq - 1} of {envelope.gateway} are missing", gateway=envelope.gateway
        )
    seq, previous = head.seq, head.hash
    for event in events:
        seq += 1
        fields = event.model_dump(exclude={"seq", "hash"})
        previous = event_hash(previous, gateway=envelope.gateway, seq=seq, **fields)
        if event.seq != seq or event.hash != previous:
            raise BrokenChainError(
                f"event {event.seq} of {envelope.gateway} does not follow from event {seq - 1}",
                hint="verify that gateway's journal: waydrop verify-journal",
                gateway=envelope.gateway,
                seq=event.seq,
            )
    return events


def site_of(vehicle_id: str) -> str:
    """The site of a vehicle of the cluster: `north` of `north-v1`."""
    return vehicle_id.partition("-")[0]
