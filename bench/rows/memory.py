"""What a service keeps in memory: idle, for each vehicle, for each websocket.

The floors only import libraries; hold a vehicle by mavsdk alone; hold a websocket by aiohttp alone.
"""

from __future__ import annotations

import asyncio
import subprocess
import sys
import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Final

import aiohttp

from bench.machine import ROOT
from bench.row import Goal, Pair, Round, Row, Scale
from bench.rows.start import LIBRARIES, service, wait_ready
from tests.support.service_process import Dispatcher, ServiceProcess
from tests.support.simulated import SimulatedFleet, free_udp_ports

RESIDENT: Final = "VmRSS:"
STATUS: Final = "print(open('/proc/self/status').read())"
SOCKETS: Final = 200
VEHICLES: Final = 20
SETTLE_S: Final = 3.0
"""Until what a new vehicle sends first is known."""
FOUND_S: Final = 120.0

AIOHTTP_ALONE: Final = """
import asyncio, sys
from aiohttp import web

async def hold(request):
    socket = web.WebSocketResponse()
    await socket.prepare(request)
    async for _ in socket:
        pass
    return socket

async def main():
    app = web.Application()
    app.router.add_get("/", hold)
    runner = web.AppRunner(app)
    await runner.setup()
    site = web.TCPSite(runner, "127.0.0.1", 0)
    await site.start()
    print(runner.addresses[0][1], flush=True)
    await asyncio.Event().wait()

asyncio.run(main())
"""

MAVSDK_ALONE: Final = """
import sys, time
from app.vehicles.native import NativeInstance


def status():
    print(next(line for line in open("/proc/self/status") if line.startswith("VmRSS:")), end="", flush=True)

instance = NativeInstance(sys.argv[1])
status()
count = int(sys.argv[2])
while count > 0:
    count -= len(instance.new_systems())
    time.sleep(0.05)
time.sleep(float(sys.argv[3]))
status()
instance.destroy()
"""


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


def resident_kb(pid: int) -> float:
    """Of a process [kB]."""
    return resident_mb(Path(f"/proc/{pid}/status").read_text()) * 1e3


def nobody() -> str:
    """A connection on which no vehicle is. To be asked for before a fleet is started: that binds no port."""
    return f"udpin://127.0.0.1:{free_udp_ports(1)}"


async def with_sockets(url: str, pid: int) -> float:
    """What each of some websockets adds to the process that serves them [kB]."""
    async with aiohttp.ClientSession(connector=aiohttp.TCPConnector(limit=0)) as http:
        first = await http.ws_connect(url)
        before_kb = resident_kb(pid)
        sockets = [await http.ws_connect(url) for _ in range(SOCKETS)]
        await asyncio.sleep(SETTLE_S)
        grown_kb = resident_kb(pid) - before_kb
        for socket in (first, *sockets):
            await socket.close()
    return grown_kb / SOCKETS


async def of_sockets() -> Pair:
    """Of the service, which has nothing to tell them, and of aiohttp alone."""
    with tempfile.TemporaryDirectory() as folder, ServiceProcess(Path(folder) / "data", [nobody()]) as of:
        ours = await with_sockets(f"{of.url}/api/v1/stream", of.pid)
    alone = await asyncio.create_subprocess_exec(sys.executable, "-c", AIOHTTP_ALONE, stdout=asyncio.subprocess.PIPE)
    assert alone.stdout is not None
    try:
        port = int(await alone.stdout.readline())
        return Pair(ours, await with_sockets(f"http://127.0.0.1:{port}/", alone.pid))
    finally:
        alone.kill()
        await alone.wait()


async def mavsdk_alone(url: str) -> float:
    """What each vehicle adds to a process that has mavsdk [kB]."""
    command = (sys.executable, "-c", MAVSDK_ALONE, url, str(VEHICLES), str(SETTLE_S))
    alone = await asyncio.create_subprocess_exec(*command, cwd=ROOT, stdout=asyncio.subprocess.PIPE)
    said, _ = await alone.communicate()
    before_mb, after_mb = (resident_mb(line) for line in said.decode().splitlines())
    return (after_mb - before_mb) * 1e3 / VEHICLES


async def of_vehicles() -> Pair:
    """Of the service without and with them, on one port and one journal, and of mavsdk alone; one after the other."""
    with tempfile.TemporaryDirectory() as folder:
        with ServiceProcess(Path(folder), [nobody()]):
            pass  # a process that makes a journal keeps memory which vehicles would fill
        with ServiceProcess(Path(folder), [nobody()]) as idle:
            await asyncio.sleep(SETTLE_S)
            before_kb = resident_kb(idle.pid)
        with SimulatedFleet(",".join(["quad"] * VEHICLES), shared_port=True) as fleet:
            with ServiceProcess(Path(folder), fleet.connections) as of:
                async with aiohttp.ClientSession() as http:
                    await Dispatcher(http, of.url).until_vehicles(VEHICLES, within_s=FOUND_S)
                await asyncio.sleep(SETTLE_S)
                ours_kb = (resident_kb(of.pid) - before_kb) / VEHICLES
            return Pair(ours_kb, await mavsdk_alone(fleet.connections[0]))


@asynccontextmanager
async def each_time(measure: Round) -> AsyncIterator[Round]:
    """Nothing is shared."""
    yield measure


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
        limited_by="code and classes: Waydrop's own, SQLAlchemy's, aiohttp's and pydantic's",
        rounds=3,
    ),
    Row(
        name="memory-socket",
        title=f"memory for each of {SOCKETS} websockets",
        floor="aiohttp alone",
        unit="kB",
        goal=Goal(3.0, "at most"),
        prepare=lambda scale: each_time(of_sockets),
        limited_by="its bounded queue, its task, what it subscribed to",
        rounds=2,
    ),
    Row(
        name="memory-vehicle",
        title=f"memory for each of {VEHICLES} vehicles on one port",
        floor="mavsdk alone",
        unit="kB",
        version=2,
        goal=Goal(3.0, "at most"),
        prepare=lambda scale: each_time(of_vehicles),
        limited_by="mavsdk itself, its subscriptions and the heaps of its threads, the vehicle's parameters",
        rounds=2,
    ),
)
