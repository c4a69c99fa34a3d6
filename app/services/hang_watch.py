"""Ends the process when its event loop hangs, so that a supervisor restarts it.

While the loop hangs, nothing passes the link guard: vehicles detect a lost link, and NAV_DLL_ACT acts. The watchdog is
in C (faulthandler) and works while Python does not.
"""

from __future__ import annotations

import asyncio
import contextlib
import faulthandler
import sys
from collections.abc import AsyncIterator
from typing import Final

AGAIN_SHARE: Final = 0.2
"""How often the loop shows that it lives, as a part of the limit."""


@contextlib.asynccontextmanager
async def hang_watch(limit_s: float) -> AsyncIterator[None]:
    """A loop that does not turn for `limit_s` ends the process with all stacks on stderr. 0: no watch."""
    if limit_s <= 0:
        yield
        return
    showing = asyncio.create_task(_show_life(limit_s), name="hang watch")
    try:
        yield
    finally:
        showing.cancel()
        faulthandler.cancel_dump_traceback_later()


async def _show_life(limit_s: float) -> None:
    while True:
        faulthandler.dump_traceback_later(limit_s, exit=True, file=sys.__stderr__ or sys.stderr)
        await asyncio.sleep(limit_s * AGAIN_SHARE)
