"""A row in a process of its own, from any folder that Waydrop's source lies in."""

from __future__ import annotations

import asyncio
import json
import os
import signal
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any, Final

from bench.row import Pair

PREPARED_S: Final = 180.0
ROUND_S: Final = 300.0
END_S: Final = 30.0
ENVIRONMENT: Final = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
"""As for somebody who installed Waydrop: what starts is compiled already."""


class RowFailedError(Exception):
    """The row's process ended, or took too long."""


class RowProcess:
    """`row` is what it said of itself."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process
        self.row: dict[str, Any] = {}

    async def prepare(self) -> None:
        """Wait until it can measure. Raises RowFailedError."""
        self.row = await self._line(PREPARED_S)

    async def measure(self) -> Pair:
        """One round. Raises RowFailedError."""
        assert self._process.stdin is not None
        with suppress(ConnectionError):
            self._process.stdin.write(b"\n")
            await self._process.stdin.drain()
        return Pair(**await self._line(ROUND_S))

    async def close(self) -> None:
        """End it, with all that it started."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        try:
            async with asyncio.timeout(END_S):
                await self._process.wait()
        except TimeoutError:
            os.killpg(self._process.pid, signal.SIGKILL)
            await self._process.wait()

    async def _line(self, within_s: float) -> dict[str, Any]:
        assert self._process.stdout is not None
        try:
            async with asyncio.timeout(within_s):
                line = await self._process.stdout.readline()
        except TimeoutError:
            raise RowFailedError(f"it said nothing for {within_s:g} s") from None
        if not line:
            raise RowFailedError("its process ended; it says why above")
        try:
            said: dict[str, Any] = json.loads(line)
        except ValueError:
            raise RowFailedError(f"it wrote {line[:80]!r}") from None
        return said


@asynccontextmanager
async def row_process(name: str, root: Path, python: Path, *, long: bool) -> AsyncIterator[RowProcess]:
    """Ready to measure. Raises RowFailedError."""
    process = await asyncio.create_subprocess_exec(
        *(str(python), "-m", "bench.child", name, *(("--long",) if long else ())),
        cwd=root,
        env=ENVIRONMENT,
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        start_new_session=True,
    )
    found = RowProcess(process)
    try:
        await found.prepare()
        yield found
    finally:
        await found.close()
