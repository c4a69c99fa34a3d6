"""Hold after control has ended: commanded in a task of its own, because what ends control does not wait."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import structlog

from app.domain.errors import WaydropError

log = structlog.get_logger(__name__)


class Holding:
    """`hold` commands it and may raise LinkError; `unconfirmed` is then told why, in words."""

    def __init__(
        self, vehicle_id: str, hold: Callable[[], Awaitable[None]], unconfirmed: Callable[[str], None]
    ) -> None:
        self._vehicle_id = vehicle_id
        self._command = hold
        self._unconfirmed = unconfirmed
        self._holding: asyncio.Task[None] | None = None

    @property
    def is_under_way(self) -> bool:
        """Whether it is being commanded now, and no answer has come."""
        return self._holding is not None and not self._holding.done()

    def soon(self) -> None:
        """Command it now, and not twice; returns at once."""
        self.cancel()
        self._holding = asyncio.create_task(self._hold(), name=f"hold {self._vehicle_id}")

    def cancel(self) -> None:
        """Somebody else has the vehicle now, or says Hold himself: not said again."""
        if self._holding is not None:
            self._holding.cancel()

    async def end(self, within_s: float) -> None:
        """Wait so long for it; the vehicle's own failsafe does the rest."""
        if self._holding is not None:
            await asyncio.wait({self._holding}, timeout=within_s)
            self._holding.cancel()

    async def _hold(self) -> None:
        try:
            await self._command()
        except WaydropError as error:
            log.warning("hold after offboard control not confirmed", vehicle=self._vehicle_id, error=error.detail)
            self._unconfirmed(error.detail)
