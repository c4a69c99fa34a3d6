"""The worker process of a service, seen from outside."""

from __future__ import annotations

from pathlib import Path

MODULE = b"app.services.worker_main"


def is_there(pid: int) -> bool:
    """Whether a process runs: one that has ended and was not waited for does not."""
    try:
        return ") Z " not in Path(f"/proc/{pid}/stat").read_text(encoding="utf-8")
    except (FileNotFoundError, ProcessLookupError):
        return False


def is_worker(pid: int) -> bool:
    """Whether a process is the worker of some service."""
    return is_there(pid) and MODULE in Path(f"/proc/{pid}/cmdline").read_bytes()


def workers_of(parent: int) -> list[int]:
    """The worker processes that a process has."""
    tasks = Path(f"/proc/{parent}/task").glob("*/children")
    return [int(pid) for task in tasks for pid in task.read_text().split() if is_worker(int(pid))]
