"""The machine beneath a measurement, and what others did on it meanwhile."""

from __future__ import annotations

import os
import platform
import resource
from pathlib import Path
from typing import Any, Final

ROOT: Final = Path(__file__).resolve().parent.parent


def described() -> dict[str, Any]:
    """What a reader must know to compare."""
    model = next(
        (line.partition(":")[2].strip() for line in _lines("/proc/cpuinfo") if line.startswith("model name")), ""
    )
    return {"cpu": model or platform.machine(), "cores": os.cpu_count(), "python": platform.python_version()}


class Others:
    """What share of the machine's CPU time processes took that are not ours, since it was made."""

    def __init__(self) -> None:
        self._busy, self._total = _cpu_ticks()
        self._own_s = _own_cpu_s()

    def share(self) -> float:
        """0 to 1. Children count as ours once they were waited for."""
        busy, total = _cpu_ticks()
        ours = (_own_cpu_s() - self._own_s) * os.sysconf("SC_CLK_TCK")
        return max(0.0, min(1.0, (busy - self._busy - ours) / max(total - self._total, 1)))


def _cpu_ticks() -> tuple[int, int]:
    ticks = [int(text) for text in _lines("/proc/stat")[0].split()[1:9]]
    idle = ticks[3] + ticks[4]
    return sum(ticks) - idle, sum(ticks)


def _own_cpu_s() -> float:
    used = (resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN))
    return sum(one.ru_utime + one.ru_stime for one in used)


def _lines(path: str) -> list[str]:
    return Path(path).read_text(encoding="ascii", errors="replace").splitlines()
