"""Lets the loop turn within work that is long by its count: links, runs and sockets must not wait for the queue."""

from __future__ import annotations

import asyncio
import time
from typing import Final

SLICE_S: Final = 0.001
"""Of the 5 ms that a slice may take: what is done between two looks at it takes its time too."""


class TimeSlice:
    """One piece of work's own. Our time alone counts, so a fast clock of the vehicles changes nothing."""

    def __init__(self) -> None:
        self._since_s = time.monotonic()

    async def take(self) -> None:
        """Yield to the event loop if the time slice is used up."""
        if time.monotonic() - self._since_s >= SLICE_S:
            await self.give()

    async def give(self) -> None:
        """Yield to the event loop."""
        await asyncio.sleep(0)
        self._since_s = time.monotonic()
