"""Processes that are started and ended beside a loop that goes on."""

from __future__ import annotations

import asyncio
from contextlib import AbstractContextManager, AsyncExitStack
from typing import TypeVar

T = TypeVar("T")


async def entered(stack: AsyncExitStack, what: AbstractContextManager[T]) -> T:
    """Begin it in a thread, and end it with the stack in another: what else the loop does goes on."""

    async def leave() -> None:
        await asyncio.to_thread(what.__exit__, None, None, None)

    begun = await asyncio.to_thread(what.__enter__)
    stack.push_async_callback(leave)
    return begun
