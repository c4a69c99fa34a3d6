"""A process beside the service for long pure work. In a thread, it would hold the interpreter's lock that the event
loop needs, also while the operating system has suspended it.
"""

from __future__ import annotations

import asyncio
import os
import pickle
import sys
from asyncio.subprocess import PIPE, Process
from collections.abc import Callable
from enum import Enum, auto
from pathlib import Path
from typing import Any, Final, TypeVar

import structlog

from app.services.worker_main import HEAD, framed

log = structlog.get_logger(__name__)
ResultT = TypeVar("ResultT")

ROOT: Final = Path(__file__).parents[2]
"""Where `app` is: the worker must run the same code, from whatever folder the service was started."""
ANSWER_S: Final = 30.0
"""A worker that takes longer is stuck: the largest plan takes it a second on a busy machine."""
END_S: Final = 2.0
READ_AT_ONCE: Final = 2**20


class WorkerLostError(Exception):
    """The worker could not be started, or ended before it answered."""


class WorkerTimeoutError(Exception):
    """The worker did not answer in time. The same work would take this process as long, so do not repeat it."""


class _Unanswered(Enum):
    LOST = auto()
    TIMED_OUT = auto()


class WorkerProcess:
    """One process, started at the first call and again after it ended. It works on one call after the other.

    Whoever waits for a turn holds its own request, so what bounds requests bounds those that wait.
    """

    def __init__(self, answer_s: float = ANSWER_S) -> None:
        self._answer_s = answer_s
        self._turn = asyncio.Lock()
        self._process: Process | None = None
        self._exchange: asyncio.Task[bytes | _Unanswered] | None = None
        self._closed = False

    @property
    def pid(self) -> int | None:
        """None while there is none."""
        return None if self._process is None or self._process.returncode is not None else self._process.pid

    @property
    def is_busy(self) -> bool:
        """Whether it works on a call."""
        return self._exchange is not None and not self._exchange.done()

    async def call(self, work: Callable[..., ResultT], *given: Any) -> ResultT:
        """What a pure function of a module returns; function, arguments and result are pickled.

        A call that is cancelled in its turn is answered nevertheless, and the answer dropped. Raises WorkerLostError,
        WorkerTimeoutError.
        """
        pickled = await asyncio.to_thread(pickle.dumps, (work, given), pickle.HIGHEST_PROTOCOL)
        async with self._turn:
            if self._exchange is not None:  # of a call that was cancelled
                await asyncio.wait([self._exchange])
            self._exchange = asyncio.create_task(self._answer(framed(pickled)), name="worker's answer")
            answer = await asyncio.shield(self._exchange)
        if answer is _Unanswered.LOST:
            raise WorkerLostError("the worker process ended before it answered")
        if answer is _Unanswered.TIMED_OUT:
            raise WorkerTimeoutError(f"no answer within {self._answer_s:g} s")
        result: ResultT = await asyncio.to_thread(pickle.loads, answer)
        return result

    async def close(self) -> None:
        """End the process in order, then for good. Idempotent."""
        self._closed = True
        if (process := self._process) is None:
            return
        assert process.stdin is not None, "it was started with one"
        process.stdin.close()
        try:
            async with asyncio.timeout(END_S):
                await process.wait()
        except TimeoutError:
            await self._kill(process)
        if self._exchange is not None:
            await asyncio.wait([self._exchange])

    async def _answer(self, call: bytes) -> bytes | _Unanswered:
        if self._closed:
            return _Unanswered.LOST
        try:
            async with asyncio.timeout(self._answer_s):
                process = await self._running()
                assert process.stdin is not None, "it was started with pipes"
                assert process.stdout is not None, "it was started with pipes"
                process.stdin.write(call)
                await process.stdin.drain()
                (size,) = HEAD.unpack(await process.stdout.readexactly(HEAD.size))
                return await process.stdout.readexactly(size)
        except TimeoutError:
            log.warning("the worker process did not answer in time; its work is given up", after_s=self._answer_s)
            await self._end_now()
            return _Unanswered.TIMED_OUT
        except (OSError, asyncio.IncompleteReadError) as error:
            if not self._closed:
                log.warning("the worker process is lost; its work is done in the service", error=repr(error))
            await self._end_now()
            return _Unanswered.LOST

    async def _end_now(self) -> None:
        if self._process is not None:
            await self._kill(self._process)

    async def _running(self) -> Process:
        if self._process is None or self._process.returncode is not None:
            paths = filter(None, (str(ROOT), os.environ.get("PYTHONPATH")))
            self._process = await asyncio.create_subprocess_exec(
                *(sys.executable, "-P", "-m", "app.services.worker_main"),
                stdin=PIPE,
                stdout=PIPE,
                limit=READ_AT_ONCE,
                env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
                process_group=0,  # a Ctrl-C in the terminal is for the service alone
            )
        return self._process

    @staticmethod
    async def _kill(process: Process) -> None:
        if process.returncode is None:
            process.kill()
        await process.wait()
