"""The worker process of a service, seen from outside."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

MODULE = b"app.services.worker_main"


def is_there(pid: int) -> bool:
    """Whether a process runs: one that has ended and was not waited for does not."""
    stat = _read(Path(f"/proc/{pid}/stat"))
    return bool(stat) and b") Z " not in stat


def is_worker(pid: int) -> bool:
    """Whether a process is the worker of some service."""
    return is_there(pid) and MODULE in _read(Path(f"/proc/{pid}/cmdline"))


def workers_of(parent: int) -> list[int]:
    """The worker processes that a process has."""
    tasks = Path(f"/proc/{parent}/task").glob("*/children")
    return [int(pid) for task in tasks for pid in _read(task).split() if is_worker(int(pid))]


@contextmanager
def stopped(pid: int) -> Iterator[None]:
    """Within the block a process does nothing."""
    os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(pid, signal.SIGCONT)


def _read(file: Path) -> bytes:
    """Nothing if its process or thread has just ended."""
    try:
        return file.read_bytes()
    except (FileNotFoundError, ProcessLookupError):
        return b""
