"""Reports of moving targets, shared: API nodes take them, and every gateway that follows a target hears them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from pydantic import BaseModel, ValidationError

from app.domain.cluster.errors import BusDownError
from app.domain.cluster.ports import Bus
from app.domain.errors import WaydropError
from app.domain.targets import TargetFix, TargetReport
from app.services.clock import Clock
from app.services.targets import Targets

TARGETS_SUBJECT: Final = "waydrop.targets"


class _Shared(BaseModel):
    feed: str
    report: TargetReport


def receive_target(take: Callable[[str, TargetReport], object], message: bytes) -> None:
    """Take a report that another node took. One that is older than the known one, or of the future, is dropped."""
    with suppress(ValidationError, WaydropError):
        shared = _Shared.model_validate_json(message)
        take(shared.feed, shared.report)


class SharedTargets(Targets):
    """Targets whose reports are told to all others, also to this node. Only the newest report of each feed is sent."""

    def __init__(self, clock: Clock, bus: Bus) -> None:
        super().__init__(clock)
        self._bus = bus
        self._unsent: dict[str, TargetReport] = {}
        self._filled = asyncio.Event()

    def report(self, feed: str, report: TargetReport) -> TargetFix:
        fix = super().report(feed, report)
        self._unsent[feed] = report
        self._filled.set()
        return fix

    def hear(self, feed: str, report: TargetReport) -> None:
        """Add a report that was told to all: it is not told again. Raises as `report`."""
        super().report(feed, report)

    async def run(self) -> None:
        """Send until cancelled."""
        while True:
            await self._filled.wait()
            self._filled.clear()
            unsent, self._unsent = self._unsent, {}
            for feed, report in unsent.items():
                with suppress(BusDownError):
                    await self._bus.publish(
                        TARGETS_SUBJECT, _Shared(feed=feed, report=report).model_dump_json().encode()
                    )
