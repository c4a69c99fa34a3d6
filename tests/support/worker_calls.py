"""What tests have a worker process do. It imports this alone: a module of tests would take it a second."""

from __future__ import annotations

import os
import signal
from pathlib import Path

from tests.support.workers import is_worker


def own_pid(_: bytes) -> int:
    return os.getpid()


def tell(_: bytes, path: str, what: str) -> None:
    with Path(path).open("a", encoding="utf-8") as file:
        file.write(f"{what}\n")


def what_was_told(path: str) -> list[str]:
    return Path(path).read_text(encoding="utf-8").split()


def end_any_worker() -> int:
    """Kills its own process if that is a worker."""
    if is_worker(os.getpid()):
        os.kill(os.getpid(), signal.SIGKILL)
    return os.getpid()
