"""How steadily setpoints leave: send intervals at 20 and 50 Hz, idle and with 100 websocket clients and a busy core.

Usage: python -m bench.offboard_jitter [--seconds 10] [--clients 100]

The whole service in this process, with a vehicle that only notes the time at which each setpoint reaches its link; the
clients and the busy loop are processes of their own. Bound: p99 within 20 % of the period. The floor is a bare asyncio
loop that sleeps to the same grid, at the same time in a process of its own; where the machine keeps even that beyond
the bound, the floor is the measure.
"""

from __future__ import annotations

import argparse
import asyncio
import multiprocessing
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import aiohttp

from app.api.health import METRICS
from app.domain.offboard.messages import SetpointMessage
from app.domain.offboard.setpoints import ZERO_VELOCITY
from app.domain.vehicle.state import LandedState
from app.services.offboard.stream import next_due_s
from tests.support.service_in_process import SETTINGS, Service, run_service, until

MOST_OFF = 0.2
LOOK_S = 0.05
TELEMETRY_S = 0.2
"""As deployed; the service of the tests tells ten times as often."""


async def floor(rate_hz: float, seconds: float) -> list[float]:
    """Times of a bare loop on the same grid."""
    times: list[float] = []
    due_s = time.monotonic()
    until_s = due_s + seconds
    while time.monotonic() < until_s:
        times.append(time.monotonic())
        due_s = next_due_s(due_s, time.monotonic(), 1.0 / rate_hz)
        await asyncio.sleep(max(0.0, due_s - time.monotonic()))
    return times


async def flown(service: Service, rate_hz: float, seconds: float) -> list[float]:
    """Times at which setpoints reach the link of a vehicle that is under control."""
    link, offboard = service.links[0], service.services.offboard.vehicle("v1")
    times: list[float] = []

    def note(_: SetpointMessage) -> None:
        times.append(time.monotonic())

    link.send_setpoint = note  # type: ignore[method-assign, assignment]
    link.change(armed=True, landed=LandedState.IN_AIR, absolute_altitude_m=520.0)
    lease = offboard.acquire("bench", rate_hz=rate_hz)
    await offboard.enter(lease.id, sticks_held=False)
    times.clear()
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s:
        offboard.put(lease.id, ZERO_VELOCITY)
        await asyncio.sleep(LOOK_S)
    found = list(times)
    await offboard.leave(lease.id, "hold")
    return found


def watch(url: str, clients: int) -> None:
    """Clients that take everything that the stream tells."""

    async def one(http: aiohttp.ClientSession) -> None:
        async with http.ws_connect(f"{url}/api/v1/stream") as socket:
            async for _ in socket:
                pass

    async def all_of_them() -> None:
        async with aiohttp.ClientSession(connector=aiohttp.TCPConnector(limit=0)) as http:
            await asyncio.gather(*(one(http) for _ in range(clients)))

    asyncio.run(all_of_them())


def burn() -> None:
    """One core, busy."""
    while True:
        sum(range(1000))


@asynccontextmanager
async def loaded(service: Service, clients: int) -> AsyncIterator[None]:
    """The clients and the busy core, until the end."""
    spawn = multiprocessing.get_context("spawn")
    burden = [
        spawn.Process(target=watch, args=(service.url, clients), daemon=True),
        spawn.Process(target=burn, daemon=True),
    ]
    for process in burden:
        process.start()
    await until(lambda: service.app[METRICS].sockets._value.get() >= clients, timeout_s=60.0)
    try:
        yield
    finally:
        for process in burden:
            process.terminate()
            process.join()


def p99_of(name: str, rate_hz: float, times: Sequence[float]) -> float:
    """One line; p99 as a share of the period."""
    period_ms = 1e3 / rate_hz
    intervals = sorted((b - a) * 1e3 for a, b in pairwise(times))
    p50, p99 = intervals[len(intervals) // 2], intervals[int(len(intervals) * 0.99)]
    sys.stdout.write(
        f"{name:20} {rate_hz:3.0f} Hz n {len(intervals):4}  p50 {p50:6.2f} p99 {p99:6.2f} max {intervals[-1]:6.2f} ms"
    )
    sys.stdout.write(f"  p99/period {p99 / period_ms:.2f}\n")
    return p99 / period_ms


async def floor_beside(rate_hz: float, seconds: float) -> asyncio.subprocess.Process:
    """The floor in a process of its own: it meets the same machine at the same time, and nothing of the service.

    Returns when it has begun.
    """
    arguments = ("-m", "bench.offboard_jitter", "--floor-hz", str(rate_hz), "--seconds", str(seconds))
    child = await asyncio.create_subprocess_exec(sys.executable, *arguments, stdout=asyncio.subprocess.PIPE)
    if child.stdout is not None:
        await child.stdout.readline()
    return child


async def compared(name: str, service: Service, rate_hz: float, seconds: float) -> bool:
    """Floor and stream at the same time; whether the stream is within the bound, or as good as the floor is."""
    child = await floor_beside(rate_hz, seconds)
    times = await flown(service, rate_hz, seconds)
    told, _ = await child.communicate()
    bare_times = [float(time_s) for time_s in told.split()]
    bare = p99_of(f"bare loop, {name}", rate_hz, bare_times)
    stream = p99_of(f"setpoints, {name}", rate_hz, times)
    busy = min(bare, stream) > 1 + MOST_OFF
    good = stream <= (bare * (1 + MOST_OFF) if busy else 1 + MOST_OFF)
    why = "the machine is too busy for the bound: measured against the bare loop" if busy else "within the bound"
    sys.stdout.write(f"    stream/floor {stream / bare:.2f}: {why if good else 'BEYOND'}\n")
    return good


async def main(seconds: float, clients: int) -> int:
    """All measurements; the exit status."""
    good = True
    settings = replace(SETTINGS, max_sockets=clients + 16, max_sockets_per_token=clients + 16)
    with tempfile.TemporaryDirectory() as folder:
        async with run_service(Path(folder), settings=settings, telemetry_period_s=TELEMETRY_S) as service:
            for rate_hz in (20.0, 50.0):
                good &= await compared("idle", service, rate_hz, seconds)
            async with loaded(service, clients):
                for rate_hz in (20.0, 50.0):
                    good &= await compared("loaded", service, rate_hz, seconds)
    return 0 if good else 1


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--clients", type=int, default=100)
    parser.add_argument("--floor-hz", type=float, default=None, help="only the bare loop: its times")
    given = parser.parse_args()
    if given.floor_hz is not None:
        sys.stdout.write("begins\n")
        sys.stdout.flush()
        sys.stdout.write(" ".join(map(str, asyncio.run(floor(given.floor_hz, given.seconds)))))
        sys.exit(0)
    sys.exit(asyncio.run(main(given.seconds, given.clients)))
