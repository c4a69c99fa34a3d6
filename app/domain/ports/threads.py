"""Work beside the event loop."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeVar

ResultT = TypeVar("ResultT")


class InThread(Protocol):
    """Runs a function in some thread: `asyncio.to_thread`, or threads that others do not use."""

    async def __call__(self, work: Callable[..., ResultT], /, *given: Any) -> ResultT:
        """What `work` returns of `given`."""
