"""The fan-out of stored events: every subscriber gets each one, in order, or is cut off for being too slow."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Sequence

from app.domain.errors import WaydropError
from app.domain.events import Event


class SubscriptionClosedError(WaydropError):
    """The subscription has ended and everything in it was taken."""

    code = "stream.closed"


class SubscriptionOverflowError(SubscriptionClosedError):
    """The subscriber was too slow and was cut off: read the journal from the last event seen."""

    code = "stream.overflow"


class EventSubscription:
    """A bounded queue of events for one reader.

    `after` is the newest event fanned out when it was made: the first event in it is `after + 1`. A reader with
    `capacity` events still to take when further ones come is cut off and loses them all: it must never take an event
    and miss the one before. One commit's events come at once, so the queue holds at most `capacity` and a commit.
    """

    def __init__(self, capacity: int, after: int, forget: Callable[[EventSubscription], None]) -> None:
        if capacity < 1:
            raise ValueError("a subscription needs room for an event")
        self.after = after
        self._capacity = capacity
        self._forget = forget
        self._events: deque[Event] = deque()
        self._changed = asyncio.Event()
        self._overflowed = False
        self._closed = False

    @property
    def overflowed(self) -> bool:
        """Whether the reader was cut off."""
        return self._overflowed

    async def get(self) -> Event:
        """The next event; waits for it.

        Raises:
            SubscriptionOverflowError: the reader was too slow; what was still in the queue is gone.
            SubscriptionClosedError: closed, and all that was in it has been taken.
        """
        while (event := self.get_nowait()) is None:
            self._changed.clear()
            await self._changed.wait()
        return event

    def get_nowait(self) -> Event | None:
        """The next event if one is there, else None. Raises as `get` does."""
        if self._overflowed:
            raise SubscriptionOverflowError(
                f"the reader fell {self._capacity} events behind",
                hint="connect again with after= the last event seen",
            )
        if self._events:
            return self._events.popleft()
        if self._closed:
            raise SubscriptionClosedError("the subscription is closed")
        return None

    def close(self) -> None:
        """End it: no further events are put in. Idempotent."""
        self._closed = True
        self._changed.set()
        self._forget(self)

    def offer(self, events: Sequence[Event]) -> None:
        """Put events in, or cut the reader off if it is full. For the fan-out alone."""
        if len(self._events) >= self._capacity:
            self._overflowed = True
            self._events.clear()
            self.close()
            return
        self._events.extend(events)
        self._changed.set()


class Fanout:
    """All subscriptions. Synchronous: a slow reader costs the others nothing."""

    def __init__(self) -> None:
        self._subscriptions: dict[int, EventSubscription] = {}
        self._closed = False

    def subscribe(self, capacity: int, after: int) -> EventSubscription:
        """A subscription to what is published from now on; a closed one if nothing will be."""
        subscription = EventSubscription(capacity, after, self._forget)
        self._subscriptions[id(subscription)] = subscription
        if self._closed:
            subscription.close()
        return subscription

    def publish(self, events: Sequence[Event]) -> None:
        """Give `events` to every subscriber."""
        for subscription in tuple(self._subscriptions.values()):
            subscription.offer(events)

    def close(self) -> None:
        """Close every subscription; readers still get what was published before."""
        self._closed = True
        for subscription in tuple(self._subscriptions.values()):
            subscription.close()

    def __len__(self) -> int:
        return len(self._subscriptions)

    def _forget(self, subscription: EventSubscription) -> None:
        self._subscriptions.pop(id(subscription), None)
