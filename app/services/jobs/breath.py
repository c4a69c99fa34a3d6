"""Lets the loop turn within work that is long by its count: links, runs and sockets must not wait for the queue."""

from __future__ import annotations

import asyncio
import time
from typing import Final

SLICE_S: Final = 0.002
"""Of the 5 ms that a slice may take: what is done between two breaths takes its time too."""


class Breath:
    """One piece of work's own. Our time alone counts, so a fast clock of the vehicles changes nothing."""

    def __init__(self) -> None:
        self._since_s = time.monotonic()

    async def take(self) -> None:
        """Give the loop its turn if this work has had its slice."""
        if time.monotonic() - self._since_s >= SLICE_S:
            await self.give()

    async def give(self) -> None:
        """Give the loop its turn."""
        await asyncio.sleep(0)
        self._since_s = time.monotonic()
