"""Ending a future from another thread, when it may have ended already or nobody waits any more."""

from __future__ import annotations

import asyncio
from typing import TypeVar

T = TypeVar("T")


def settle_from_thread(future: asyncio.Future[T], result: T) -> None:
    """Set the result on the future's own loop. A future that is done and a loop that has ended are left as they are."""

    def settle() -> None:
        if not future.done():
            future.set_result(result)

    try:
        future.get_loop().call_soon_threadsafe(settle)
    except RuntimeError:
        return  # the loop has ended
