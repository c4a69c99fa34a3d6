"""Keeps the inputs of one flight, so that `waydrop replay` can let today's code decide it again."""

from __future__ import annotations

import asyncio
from typing import Final

import structlog

from app.domain.errors import StorageError
from app.domain.flight.flight import Flight
from app.domain.flight.inputs import FlightEffect, FlightInput
from app.domain.flight.log_port import FlightLog
from app.domain.flight.recording import Line, Recorder, as_text, began
from app.domain.run import Run

log = structlog.get_logger(__name__)
KEEP_EVERY: Final = 200
"""Lines at a time: some 15 s of a flight. A kill loses those that wait."""
MOST_WAITING: Final = 5000


class FlightLogbook:
    """Lines are noted at once and kept now and then. When they cannot be kept the flight goes on without them."""

    def __init__(self, store: FlightLog, flight: Flight) -> None:
        self._store = store
        self._run_id = flight.run.id
        self._recorder = Recorder(flight.run)
        self._lines: list[Line] = [began(flight)]
        self._is_cut = False

    def note(self, before: Run, heard: FlightInput, after: Flight, effects: tuple[FlightEffect, ...]) -> None:
        """One input; see Recorder. A part without a line in its middle would be decided otherwise: it ends there."""
        self._is_cut = self._is_cut or len(self._lines) >= MOST_WAITING
        if not self._is_cut:
            self._lines.append(self._recorder.line(before, heard, after, effects))

    async def keep(self, *, all_of_them: bool = False) -> None:
        """Store what waits, if it is enough for a part."""
        if not self._lines or (len(self._lines) < KEEP_EVERY and not all_of_them):
            return
        lines, self._lines = self._lines, []
        try:
            await self._store.append(self._run_id, await asyncio.to_thread(as_text, lines))
        except StorageError as error:
            self._is_cut, self._lines = True, []
            log.warning("the inputs of a flight are not kept any more", run_id=self._run_id, error=error.detail)
