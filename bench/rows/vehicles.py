"""A hundred vehicles on one port, at low rates: how soon all are known, and what CPU time they take from then on.

The floor is pymavlink alone: it answers each vehicle's HEARTBEAT with one of its own, asks for AUTOPILOT_VERSION, and
decodes what comes. It asks for no more messages than the vehicles send by themselves; Waydrop does.
"""

from __future__ import annotations

import asyncio
import os
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import aiohttp

from bench.machine import ROOT
from bench.row import Goal, Pair, Round, Row
from tests.support.service_process import Dispatcher, ServiceProcess
from tests.support.simulated import SimulatedFleet

VEHICLES: Final = 100
FOUND_S: Final = 120.0
FLOWN_S: Final = 10.0

PYMAVLINK_ALONE: Final = """
import resource, socket, sys, time
from pymavlink.dialects.v20 import common as m

port, vehicles, seconds = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
heard = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
heard.bind(("127.0.0.1", port))
mav = m.MAVLink(None, srcSystem=245, srcComponent=190)
beat = m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
known, peers, until = set(), {}, None
begun, beaten = time.monotonic(), 0.0
while until is None or time.monotonic() < until:
    datagram, peer = heard.recvfrom(2048)
    for message in mav.parse_buffer(datagram) or ():
        system = message.get_srcSystem()
        peers[system] = peer
        if message.get_type() == "AUTOPILOT_VERSION":
            known.add(system)
    if time.monotonic() >= beaten + 1.0:
        beaten = time.monotonic()
        for system, at in peers.items():
            heard.sendto(beat.pack(mav), at)
            if system not in known:
                asked = m.MAVLink_command_long_message(system, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0)
                heard.sendto(asked.pack(mav), at)
    if until is None and len(known) >= vehicles:
        set_up = time.monotonic() - begun
        until, before = time.monotonic() + seconds, time.process_time()
print(set_up, (time.process_time() - before) / seconds, flush=True)
"""


@dataclass(frozen=True, slots=True)
class Fleet:
    """How soon all vehicles were known [s], and the share of a core from then on."""

    set_up_s: float
    cores: float


def cpu_s(pid: int) -> float:
    """User and system time of a process."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def of_service(connection: str, vehicles: int) -> Fleet:
    """From the moment the service is ready."""
    with tempfile.TemporaryDirectory() as folder:
        url = f"{connection}?most_systems={vehicles}"
        with ServiceProcess(Path(folder) / "data", [url]) as service:
            began_s = time.monotonic()
            async with aiohttp.ClientSession() as http:
                await Dispatcher(http, service.url).until_vehicles(vehicles, within_s=FOUND_S)
            set_up_s = time.monotonic() - began_s
            before_s = cpu_s(service.pid)
            await asyncio.sleep(FLOWN_S)
            return Fleet(set_up_s, (cpu_s(service.pid) - before_s) / FLOWN_S)


async def of_pymavlink(port: int) -> Fleet:
    """In a process of its own."""
    command = (sys.executable, "-c", PYMAVLINK_ALONE, str(port), str(VEHICLES), str(FLOWN_S))
    alone = await asyncio.create_subprocess_exec(*command, cwd=ROOT, stdout=asyncio.subprocess.PIPE)
    async with asyncio.timeout(FOUND_S):
        said, _ = await alone.communicate()
    set_up_s, cores = (float(part) for part in said.split())
    return Fleet(set_up_s, cores)


async def both() -> tuple[Fleet, Fleet]:
    """Each with a fleet that has never heard of a ground station."""
    fleet = ",".join(["quad"] * VEHICLES)
    with SimulatedFleet(fleet, shared_port=True) as simulated:
        ours = await of_service(simulated.connections[0], VEHICLES)
    with SimulatedFleet(fleet, shared_port=True) as simulated:
        return ours, await of_pymavlink(simulated.port)


@asynccontextmanager
async def rounds(value: Callable[[Fleet], float]) -> AsyncIterator[Round]:
    """Nothing is shared. `value` is what a row shows of a fleet."""

    async def measure() -> Pair:
        ours, floor = await both()
        return Pair(value(ours), value(floor))

    yield measure


_FLOOR: Final = "pymavlink alone"
ROWS: Final = (
    Row(
        name="vehicles-known",
        title=f"{VEHICLES} vehicles on one port, until all are known",
        floor=_FLOOR,
        unit="s",
        goal=Goal(10.0, "at most", of="value"),
        prepare=lambda scale: rounds(lambda fleet: fleet.set_up_s),
        limited_by="mavsdk's discovery, then each vehicle's answers, of which a few are asked for at once",
        rounds=2,
    ),
    Row(
        name="vehicles-cpu",
        title=f"{VEHICLES} vehicles on one port, from then on",
        floor=_FLOOR,
        unit="cores CPU",
        goal=Goal(0.5, "at most", of="value"),
        prepare=lambda scale: rounds(lambda fleet: fleet.cores),
        limited_by="mavsdk's JSON of each message, the guard's look at each frame, Waydrop's at each message",
        rounds=2,
    ),
)
