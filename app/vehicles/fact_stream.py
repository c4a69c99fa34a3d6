"""The listeners of one link."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from app.domain.ports.vehicle_link import Unsubscribe
from app.domain.vehicle.facts import DuplicateSystem, LinkFact, QuarantineEnded


class FactStream:
    """Emits facts to all listeners in order. A later listener first receives the current quarantine."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._listeners: list[Callable[[LinkFact], None]] = []
        self.duplicate: DuplicateSystem | None = None

    def subscribe(self, listener: Callable[[LinkFact], None]) -> Unsubscribe:
        self._listeners.append(listener)
        if self.duplicate is not None:
            self._loop.call_soon(self._emit_to, listener, self.duplicate)

        def unsubscribe() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)

        return unsubscribe

    def emit(self, fact: LinkFact) -> None:
        """Call all listeners now. A second quarantine is no news."""
        if isinstance(fact, DuplicateSystem):
            if self.duplicate is not None:
                return
            self.duplicate = fact
        elif isinstance(fact, QuarantineEnded):
            self.duplicate = None
        for listener in tuple(self._listeners):
            listener(fact)

    def close(self) -> None:
        """Emit nothing more."""
        self._listeners.clear()

    def _emit_to(self, listener: Callable[[LinkFact], None], fact: LinkFact) -> None:
        if listener in self._listeners:
            listener(fact)
