"""Where the inputs of flights are kept: storage/ implements it."""

from __future__ import annotations

from typing import Final, Protocol

MOST_BYTES: Final = 8_000_000
"""Of one run, packed: some hours of flight. What comes after is left out."""
MOST_RUNS: Final = 100
"""The newest runs whose inputs are kept."""


class FlightLog(Protocol):
    """Lines of domain/flight/recording.py. Not part of the chain: they explain a run, and are no evidence of it."""

    async def append(self, run_id: str, text: str) -> None:
        """Keep some more lines of a run, unless it has MOST_BYTES. Raises StorageError."""

    async def read(self, run_id: str) -> str:
        """All lines of a run in order; empty if there are none. Raises StorageError."""
