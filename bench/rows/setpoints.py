"""How steadily setpoints leave at 50 Hz: the 99th percentile of the intervals over the period.

The whole service in this process, with a vehicle that only notes the time at which each setpoint reaches its link; 100
websocket clients, a core that is busy, and who posts plans are processes of their own. The floor is a bare asyncio loop
that sleeps to the same grid, at the same time in a process of its own: it meets the same machine.
"""

from __future__ import annotations

import asyncio
import gc
import json
import multiprocessing
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Final

import aiohttp

from app.api.health import METRICS
from app.application import SWITCH_S
from app.domain.errors import JobQueueFullError
from app.domain.offboard.messages import SetpointMessage
from app.domain.offboard.setpoints import ZERO_VELOCITY
from app.domain.plan import parse_plan
from app.domain.vehicle.state import LandedState
from app.services.jobs import JobSettings
from app.services.jobs.views import JobRequest
from app.services.offboard.rate_loop import next_due_s
from bench.machine import ROOT
from bench.row import Goal, Pair, Round, Row, Scale
from bench.rows.plan import ITEMS, survey
from tests.support.service_in_process import SETTINGS, Service, run_service, until

RATE_HZ: Final = 50.0
CLIENTS: Final = 100
SHORT_S, LONG_S = 4.0, 20.0
"""Of one round."""
LOOK_S: Final = 0.05
TELEMETRY_S: Final = 0.2
"""As deployed; the service of the tests tells ten times as often."""


async def floor(seconds: float) -> list[float]:
    """Times of a bare loop on the same grid."""
    times: list[float] = []
    due_s = time.monotonic()
    until_s = due_s + seconds
    while time.monotonic() < until_s:
        times.append(time.monotonic())
        due_s = next_due_s(due_s, time.monotonic(), 1.0 / RATE_HZ)
        await asyncio.sleep(max(0.0, due_s - time.monotonic()))
    return times


async def flown(service: Service, seconds: float) -> list[float]:
    """Times at which setpoints reach the link of a vehicle that is under control."""
    assert service.services.offboard is not None, "a whole service has it"
    link, offboard = service.links[0], service.services.offboard.vehicle("v1")
    times: list[float] = []

    def note(_: SetpointMessage) -> None:
        times.append(time.monotonic())

    link.send_setpoint = note  # type: ignore[method-assign, assignment]
    link.change(armed=True, landed=LandedState.IN_AIR, absolute_altitude_m=520.0)
    lease = offboard.acquire("bench", rate_hz=RATE_HZ)
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


def post_plans(url: str) -> None:
    """Plans of 990 items, one check after the other."""
    body = json.dumps({"plan": survey(ITEMS)})

    async def post() -> None:
        async with aiohttp.ClientSession() as http:
            while True:
                headers = {"Content-Type": "application/json"}
                async with http.post(f"{url}/api/v1/plan-checks", data=body, headers=headers) as answer:
                    answer.raise_for_status()
                    await answer.read()

    asyncio.run(post())


Burden = tuple[Callable[..., None], tuple[object, ...]]


@asynccontextmanager
async def burdened(*burdens: Burden) -> AsyncIterator[None]:
    """Each in a process of its own, until the end."""
    spawn = multiprocessing.get_context("spawn")
    processes = [spawn.Process(target=work, args=given, daemon=True) for work, given in burdens]
    for process in processes:
        process.start()
    try:
        yield
    finally:
        for process in processes:
            process.terminate()
            process.join()


def p99_of_period(times: Sequence[float]) -> float:
    """The 99th percentile of the intervals, as a share of the period."""
    intervals = sorted(b - a for a, b in pairwise(times))
    return intervals[int(len(intervals) * 0.99)] * RATE_HZ


async def floor_beside(seconds: float) -> asyncio.subprocess.Process:
    """The floor in a process of its own. Returns when it has begun."""
    code = f"from bench.rows.setpoints import print_floor; print_floor({seconds})"
    child = await asyncio.create_subprocess_exec(sys.executable, "-c", code, stdout=asyncio.subprocess.PIPE, cwd=ROOT)
    if child.stdout is not None:
        await child.stdout.readline()
    return child


def print_floor(seconds: float) -> None:
    """What `floor_beside` runs."""
    sys.stdout.write("begins\n")
    sys.stdout.flush()
    sys.stdout.write(" ".join(map(str, asyncio.run(floor(seconds)))))


async def queue_jobs(service: Service) -> None:
    """As many jobs as may wait, for a vehicle that is in the air."""
    service.links[1].change(armed=True, landed=LandedState.IN_AIR, absolute_altitude_m=520.0)
    plan = await service.services.plans.create(parse_plan(survey(5)), "bench")
    with suppress(JobQueueFullError):
        while True:
            await service.services.jobs.create(JobRequest(plan=plan.id, vehicle="v2", min_battery_percent=0), "bench")


@asynccontextmanager
async def prepared(scale: Scale, *, busy: bool) -> AsyncIterator[Round]:
    """The service and its burden. `busy`: plans are checked and jobs wait."""
    seconds = LONG_S if scale.long else SHORT_S
    places = CLIENTS + 16
    settings = replace(
        SETTINGS,
        telemetry_period_s=TELEMETRY_S,
        max_sockets=places,
        max_sockets_per_token=places,
        body_timeout_s=30.0,
    )
    with tempfile.TemporaryDirectory() as folder:
        async with run_service(Path(folder), settings=settings, jobs_settings=JobSettings()) as service:
            if busy:
                await queue_jobs(service)
            burdens: list[Burden] = [(watch, (service.url, CLIENTS)), (burn, ())]
            if busy:
                burdens.append((post_plans, (service.url,)))
            async with burdened(*burdens):
                await until(lambda: service.app[METRICS].sockets._value.get() >= CLIENTS, timeout_s=60.0)
                gc.freeze()  # as the service does when it has started
                sys.setswitchinterval(SWITCH_S)

                async def measure() -> Pair:
                    child = await floor_beside(seconds)
                    times = await flown(service, seconds)
                    told, _ = await child.communicate()
                    return Pair(p99_of_period(times), p99_of_period([float(time_s) for time_s in told.split()]))

                yield measure


ROWS: Final = (
    Row(
        name="setpoints",
        title="setpoint interval p99, 50 Hz, 100 clients, one busy core",
        floor="a bare asyncio ticker",
        unit="periods",
        goal=Goal(1.15, "at most", of="either"),
        prepare=lambda scale: prepared(scale, busy=False),
        limited_by="the operating system's timer and scheduler",
        rounds=3,
    ),
    Row(
        name="setpoints-busy",
        title="the same while 990-item plans are checked and the job queue is full",
        floor="a bare asyncio ticker",
        unit="periods",
        goal=Goal(1.15, "at most", of="either"),
        prepare=lambda scale: prepared(scale, busy=True),
        limited_by="the operating system's timer and scheduler: plans are checked in the worker process",
        rounds=3,
    ),
)
