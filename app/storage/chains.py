"""The chains of events in a journal, as a verification follows them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final, Protocol

from app.domain.events.event import JournalHead, event_hash

HASHED: Final = ("seq", "kind", "version", "time", "vehicle_id", "run_id", "data")


class Row(Protocol):
    """A row of a table, as drivers give it."""

    def __getitem__(self, name: str, /) -> Any: ...


@dataclass(frozen=True, slots=True)
class Gap:
    """An event that does not have the seq after the one before it, `after`."""

    gateway: str
    event: Row
    after: int


class Chains:
    """The chains of gateways, filled event by event. `gaps` are events that do not follow the one before them."""

    def __init__(self) -> None:
        self.heads: defaultdict[str, JournalHead] = defaultdict(JournalHead)
        self.gaps: list[Gap] = []
        self.events = 0

    def take(self, gateway: str, event: Row) -> Iterator[str]:
        """Add an event; what is wrong with it."""
        self.events += 1
        if event["seq"] < 1:  # the hash of "event 0" is known to everybody
            yield f"event {event['seq']}: no journal has such a number"
            return
        head = self.heads[gateway]
        self.heads[gateway] = JournalHead(seq=event["seq"], hash=str(event["hash"]))
        if event["seq"] != head.seq + 1:
            self.gaps.append(Gap(gateway, event, head.seq))
        elif not fits(event, gateway, head):
            yield f"event {event['seq']}: its hash is wrong: the event or the previous hash was altered"


def fits(event: Row, gateway: str, head: JournalHead) -> bool:
    """Whether the hash of an event follows from that of the one before it, `head`."""
    try:
        hashed = event_hash(head.hash, gateway=gateway, **{name: event[name] for name in HASHED})
    except (TypeError, ValueError):  # a blob, or an infinite time: nothing that was ever written
        return False
    return bool(hashed == event["hash"])
