"""What a client that says `after=` gets: the stored events it has not seen, then the new ones, each once."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from typing import Final

from app.domain.errors import InvalidInputError
from app.domain.events import Event
from app.services.journal import Journal

PAGE_EVENTS: Final = 500


async def follow(
    journal: Journal, after: int, *, capacity: int, page_events: int = PAGE_EVENTS
) -> AsyncGenerator[Event, None]:
    """Every event with seq > after, in order, without end. Close the generator (`aclosing`) to unsubscribe.

    `capacity` bounds how far the reader may fall behind the live events.

    Raises:
        InvalidInputError: `after` is not an event of this journal.
        SubscriptionOverflowError: the reader was too slow; follow again after the last event seen.
        SubscriptionClosedError: the journal was closed.
        StorageError: the stored events cannot be read.
    """
    if not 0 <= after <= journal.last_seq:
        raise InvalidInputError(
            f"after={after}: the journal's newest event is {journal.last_seq}",
            hint="this journal is another one than that of the last visit: start with after=0",
            last_seq=journal.last_seq,
        )
    # most of a long backlog is read before subscribing, so that the live queue need not hold what comes meanwhile
    while journal.last_seq - after > page_events:
        for event in await journal.read(after, page_events):
            yield event
            after = event.seq
    subscription = journal.subscribe(capacity)
    try:
        while after < subscription.after:
            for event in await journal.read(after, min(page_events, subscription.after - after)):
                yield event
                after = event.seq
        while True:
            yield await subscription.get()
    finally:
        subscription.close()
