"""What it takes to start `waydrop --help`, `health` and `serve` until it is ready; the floor only imports libraries."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path
from typing import Final

from bench.machine import ROOT
from bench.row import Goal, Pair, Round, Row, Scale
from tests.support.service_process import free_tcp_port
from tests.support.simulated import free_udp_ports

LIBRARIES: Final = "import aiohttp, pydantic, sqlalchemy"
READY_S: Final = 60.0


def cpu_of(*command: str) -> float:
    """CPU seconds, user and system, of a process that ends by itself."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def floor() -> float:
    """CPU seconds of a Python that imports what the service stands on."""
    return cpu_of(sys.executable, "-c", LIBRARIES)


@contextmanager
def service(folder: Path) -> Iterator[tuple[subprocess.Popen[bytes], str]]:
    """`waydrop serve` with one port for vehicles; it ends with the block."""
    port = free_tcp_port()
    environment = {
        **os.environ,
        "WAYDROP_PORT": str(port),
        "WAYDROP_DATA_DIR": str(folder),
        "WAYDROP_CONNECTIONS": f"udpin://127.0.0.1:{free_udp_ports(1)}",
        "WAYDROP_LOG_FORMAT": "json",
    }
    with subprocess.Popen(
        [sys.executable, "-m", "app", "serve"],
        cwd=ROOT,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as process:
        try:
            yield process, f"http://127.0.0.1:{port}"
        finally:
            process.terminate()


def wait_ready(process: subprocess.Popen[bytes], url: str) -> None:
    """Until /readyz says so. Raises RuntimeError."""
    deadline_s = time.monotonic() + READY_S
    while time.monotonic() < deadline_s and process.poll() is None:
        try:
            with urllib.request.urlopen(f"{url}/readyz", timeout=5.0):
                return
        except (urllib.error.URLError, ConnectionError):
            time.sleep(0.01)
    raise RuntimeError(f"the service did not become ready (exit status {process.poll()})")


def cpu_until_ready(folder: Path) -> float:
    """CPU seconds of the service from its start until it answers that it is ready."""
    with service(folder) as (process, url):
        wait_ready(process, url)
        fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@asynccontextmanager
async def help_prepared(scale: Scale) -> AsyncIterator[Round]:
    """A process for each."""

    async def measure() -> Pair:
        return Pair(cpu_of(sys.executable, "-m", "app", "--help"), floor())

    await measure()
    yield measure


@asynccontextmanager
async def health_prepared(scale: Scale) -> AsyncIterator[Round]:
    """A process for each, beside a service that is ready."""
    with tempfile.TemporaryDirectory() as folder, service(Path(folder)) as (process, url):
        wait_ready(process, url)
        port = url.rpartition(":")[2]

        async def measure() -> Pair:
            return Pair(cpu_of(sys.executable, "-m", "app", "health", "--port", port), floor())

        await measure()
        yield measure


@asynccontextmanager
async def start_prepared(scale: Scale) -> AsyncIterator[Round]:
    """A process for each, on one journal."""
    with tempfile.TemporaryDirectory() as folder:

        async def measure() -> Pair:
            return Pair(cpu_until_ready(Path(folder)), floor())

        await measure()
        yield measure


ROWS: Final = (
    Row(
        name="help",
        title="`waydrop --help`",
        floor=f"python -c '{LIBRARIES}'",
        unit="s CPU",
        goal=Goal(0.5, "at most", of="value"),
        prepare=help_prepared,
        limited_by="importing typer and rich",
        rounds=5,
    ),
    Row(
        name="health",
        title="`waydrop health`, the health check of containers",
        floor=f"python -c '{LIBRARIES}'",
        unit="s CPU",
        goal=Goal(0.3, "at most", of="value"),
        prepare=health_prepared,
        limited_by="importing typer, and pydantic for its options",
        rounds=5,
    ),
    Row(
        name="start",
        title="`waydrop serve` from its start to ready",
        floor=f"python -c '{LIBRARIES}'",
        unit="s CPU",
        version=2,
        goal=Goal(2.0, "at most"),
        prepare=start_prepared,
        limited_by="importing: nearly half of it libraries, then Waydrop's own 320 dataclasses and 330 models",
        rounds=5,
    ),
)
