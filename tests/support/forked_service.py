"""The real service, forked from a process that has imported it: a start takes a third of the time of a new process."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from multiprocessing.context import ForkServerContext, ForkServerProcess
from pathlib import Path
from typing import Any, Final

from app.cli.main import main
from tests.support.service_process import ServiceProcess

IMPORTED: Final = [
    "__main__",
    "app.application",
    "app.cli.main",
    "app.cli.serve",
    "app.cluster_application",
    "mavsdk",
    "tests.support.forked_service",
]


def serve(environment: Mapping[str, str], log_path: Path, part: str = "serve") -> None:
    """`waydrop serve`, or a part of a cluster, in a process that was forked for it."""
    log = os.open(log_path, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
    os.dup2(log, 1)
    os.dup2(log, 2)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = ["waydrop", part]
    sys.exit(main())


class Forked:
    """What ServiceProcess asks of a process."""

    def __init__(self, process: ForkServerProcess) -> None:
        self._process = process

    @property
    def pid(self) -> int:
        return self._process.pid or 0

    @property
    def returncode(self) -> int | None:
        return self._process.exitcode

    def poll(self) -> int | None:
        return self._process.exitcode

    def wait(self, timeout: float | None = None) -> int:
        self._process.join(timeout)
        if self._process.exitcode is None:
            raise subprocess.TimeoutExpired("waydrop serve", timeout or 0.0)
        return self._process.exitcode


class ForkedService(ServiceProcess):
    """A service for tests that start many, and are not about the start."""

    def _spawn(self, environment: Mapping[str, str]) -> Forked:
        target, more = self.target()
        process = _context().Process(target=target, args=(dict(environment), self.log_path, *more), name="waydrop")
        process.start()
        return Forked(process)

    def target(self) -> tuple[Callable[..., None], tuple[Any, ...]]:
        """What runs in the process, and what it gets besides the environment and the path of its log."""
        return serve, (self.part,)


def _context() -> ForkServerContext:
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(IMPORTED)
    return context
