"""What a service that has nothing to do keeps in memory; the floor only imports libraries."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Final

from bench.machine import ROOT
from bench.row import Goal, Pair, Round, Row, Scale
from bench.rows.start import LIBRARIES, service, wait_ready

RESIDENT: Final = "VmRSS:"
STATUS: Final = "print(open('/proc/self/status').read())"


def resident_mb(status: str) -> float:
    """From the text of /proc/PID/status [MB]."""
    (line,) = (line for line in status.splitlines() if line.startswith(RESIDENT))
    return int(line.split()[1]) * 1024 / 1e6


def floor() -> float:
    """Of a Python that imports what the service stands on."""
    command = (sys.executable, "-c", f"{LIBRARIES}; {STATUS}")
    return resident_mb(subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout)


def of_service(folder: Path) -> float:
    """Of `waydrop serve` with one port for vehicles, when it is ready."""
    with service(folder) as (process, url):
        wait_ready(process, url)
        return resident_mb(Path(f"/proc/{process.pid}/status").read_text())


@asynccontextmanager
async def prepared(scale: Scale) -> AsyncIterator[Round]:
    """A process for each, on one journal."""
    with tempfile.TemporaryDirectory() as folder:

        async def measure() -> Pair:
            return Pair(of_service(Path(folder)), floor())

        await measure()
        yield measure


ROWS: Final = (
    Row(
        name="memory",
        title="memory of `waydrop serve` without vehicles and clients",
        floor=f"python -c '{LIBRARIES}'",
        unit="MB",
        goal=Goal(120.0, "at most", of="value"),
        prepare=prepared,
        limited_by="classes: pydantic's models and their validators, mavsdk, SQLAlchemy and NumPy",
        rounds=3,
    ),
)
