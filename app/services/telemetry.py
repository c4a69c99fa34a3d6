"""Telemetry for watchers: only the newest of each vehicle matters, nothing is queued."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from typing import Protocol

from app.services.background import begin_task, end_tasks
from app.services.views import StateView, VehicleView


class TelemetrySubscription:
    """The newest state per vehicle since the last `next()`: a slow reader gets fewer, never older ones."""

    def __init__(self, feed: TelemetryFeed) -> None:
        self._feed = feed
        self._newest: dict[str, StateView] = {}
        self._ready = asyncio.Event()

    def enqueue(self, states: Mapping[str, StateView]) -> None:
        """Add a tick."""
        self._newest.update(states)
        self._ready.set()

    async def next(self) -> Mapping[str, StateView]:
        """Wait for the next tick with changes, and return it."""
        await self._ready.wait()
        self._ready.clear()
        taken, self._newest = self._newest, {}
        return taken

    def close(self) -> None:
        """End it. Idempotent."""
        self._feed.forget(self)


class Fleetlike(Protocol):
    """What the feed needs of the fleet."""

    def vehicles(self) -> Sequence[VehicleView]:
        """All vehicles."""


class TelemetryFeed:
    """Looks at all vehicles once a period, and offers what changed to every subscription."""

    def __init__(self, fleet: Fleetlike, period_s: float = 0.2) -> None:
        self._fleet = fleet
        self._period_s = period_s
        self._subscriptions: set[TelemetrySubscription] = set()
        self._task: asyncio.Task[None] | None = None

    async def start(self) -> None:
        self._task = begin_task(self._run(), "telemetry feed")

    async def close(self) -> None:
        """Stop. Idempotent."""
        await end_tasks(self._task)

    def subscribe(self) -> TelemetrySubscription:
        """What changes from now on."""
        subscription = TelemetrySubscription(self)
        self._subscriptions.add(subscription)
        return subscription

    def forget(self, subscription: TelemetrySubscription) -> None:
        self._subscriptions.discard(subscription)

    async def _run(self) -> None:
        while True:
            await asyncio.sleep(self._period_s)
            if not self._subscriptions:
                continue
            states = {vehicle.id: vehicle.state for vehicle in self._fleet.vehicles()}
            for subscription in tuple(self._subscriptions):
                subscription.enqueue(states)
