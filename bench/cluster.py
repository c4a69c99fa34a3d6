"""A cluster under load: 1,000 generated vehicles over 8 gateway processes, one API node, NATS, PostgreSQL.

Usage: python -m bench.cluster [--seconds 4] [--rounds 4] [--vehicles 1000] [--mavlink]

400 events/s are committed and 5,000 states/s reported. Printed: the latency from the commit of an event to a client's
websocket beside that of the floor, which is nats-py, asyncpg and aiohttp alone in place of the relay and the API node,
in turns in the same run; how old states are; how fast the relay is after a partition; how soon a lease is taken over;
and the CPU time of each part. `--mavlink` adds two real gateways with 15 simulated vehicles each. Exit status 1 if a
goal is missed.

It measures speed. Whether every event arrives once and in order is judged by tests/campaigns/cluster.py.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import statistics
import sys
import time
from collections.abc import Sequence
from contextlib import AsyncExitStack
from dataclasses import dataclass, field
from typing import Final

import aiohttp

from app.domain.cluster.lease import LEASE_TTL_S
from bench import machine
from bench.cluster_client import StreamClient
from bench.cluster_mavlink import position_ages_s
from bench.cluster_parts import Parts, running, takeover_s
from bench.cluster_stages import watched
from bench.table import number, print_line

GATEWAYS: Final = 8
EVENTS_OF_VEHICLE_S: Final = 0.4
STATES_OF_VEHICLE_S: Final = 5.0
SETTLED_S: Final = 1.0
"""How long work goes on before it counts."""
ARRIVED_S: Final = 120.0
TAKEN_S: Final = 60.0
PARTITION_S: Final = 60.0
LATENCY_GOAL: Final = 1.5
RELAY_GOAL: Final = 10.0
TAKEOVER_GOAL_S: Final = LEASE_TTL_S + 2.0


class MissingError(Exception):
    """Events have not arrived."""


@dataclass
class Slice:
    """Some seconds of one kind of work. CPU time is counted until all has arrived: `*_in_all` belong to it."""

    seconds: float
    load: float
    states: int
    ages_s: list[float]
    cpu_s: dict[str, float] = field(default_factory=dict)
    events_in_all: int = 0
    states_in_all: int = 0
    after_commit_s: list[float] = field(default_factory=list)
    after_event_s: list[float] = field(default_factory=list)
    commits: dict[tuple[str, int], float] = field(default_factory=dict)


@dataclass(frozen=True)
class Offered:
    """What the gateways do in a second, all of them."""

    vehicles: int

    @property
    def events_s(self) -> float:
        """Events committed."""
        return self.vehicles * EVENTS_OF_VEHICLE_S

    @property
    def states_s(self) -> float:
        """States reported."""
        return self.vehicles * STATES_OF_VEHICLE_S


class ClusterBench:
    """Its clients follow the API node and the floor all the time."""

    def __init__(self, parts: Parts, offered: Offered, client: StreamClient, floor: StreamClient) -> None:
        self._parts = parts
        self._offered = offered
        self._client = client
        self._floor = floor

    async def slice(self, mode: str, seconds: float) -> Slice:
        """Let the gateways work, and see what arrives."""
        client = self._floor if mode == "floor" else self._client
        await self._parts.ask_all(mode)
        await asyncio.sleep(SETTLED_S)
        await self._parts.ask_all("told")
        client.ages_s, states, events = [], client.states, len(client.arrived)
        begun_s, cpu_s = time.monotonic(), self._parts.cpu_s()
        await asyncio.sleep(seconds)
        found = Slice(time.monotonic() - begun_s, os.getloadavg()[0], client.states - states, client.ages_s)
        commits = [one for answer in await self._parts.ask_all("told") for one in answer["commits"]]
        if mode != "idle":
            await self._parts.ask_all("states")
        await self._until_arrived(client, [(gateway, seq) for gateway, seq, _, _ in commits])
        found.cpu_s = {name: now_s - cpu_s[name] for name, now_s in self._parts.cpu_s().items()}
        found.events_in_all, found.states_in_all = len(client.arrived) - events, client.states - states
        for gateway, seq, committed_s, event_s in commits:
            arrived_s = client.arrived[gateway, seq]
            found.after_commit_s.append(arrived_s - committed_s)
            found.after_event_s.append(arrived_s - event_s)
            found.commits[gateway, seq] = committed_s
        return found

    async def stages(self, seconds: float) -> list[tuple[str, float]]:
        """Where the time of the median event goes, in seconds by the stage."""
        async with watched(self._parts.nats.url, self._parts.postgres.url) as stages:
            found = await self.slice("product", seconds)
        steps = (found.commits, stages.published, stages.stored, self._client.arrived)
        seen = [event for event in found.commits if all(event in step for step in steps)]
        names = ("to NATS", "to PostgreSQL", "to the client")
        return [
            (name, statistics.median(to[event] - begun[event] for event in seen))
            for name, begun, to in zip(names, steps, steps[1:], strict=False)
        ]

    async def partition(self) -> tuple[float, float, int]:
        """The events/s at the client once the first one arrives after a partition, how long that took since NATS was
        there again, and how many they were.
        """
        await self._parts.ask_all("product")
        await asyncio.sleep(SETTLED_S)
        await asyncio.to_thread(self._parts.nats.kill)
        count = int(self._offered.events_s * PARTITION_S / GATEWAYS)
        lasts = [(one["gateway"], one["last"]) for one in await self._parts.ask_all(f"backlog {count}")]
        arrived, before = self._client.arrived, set(self._client.arrived)
        await asyncio.to_thread(self._parts.nats.start)
        back_s = time.time()
        await self._until_arrived(self._client, lasts)
        end_s = max(arrived[last] for last in lasts)
        await self._parts.ask_all("states")
        times = [at_s for event, at_s in arrived.items() if event not in before and at_s <= end_s]
        return len(times) / (end_s - min(times)), end_s - back_s, len(times)

    async def _until_arrived(self, client: StreamClient, events: Sequence[tuple[str, int]]) -> None:
        """Raises RuntimeError, which says how many did not."""
        deadline_s = time.monotonic() + ARRIVED_S
        while missing := sum(event not in client.arrived for event in events):
            if time.monotonic() > deadline_s:
                told = f"{missing} of {len(events)} events have not arrived within {ARRIVED_S:g} s"
                raise MissingError(f"{told}; the client was cut {client.cuts} times")
            await asyncio.sleep(0.1)


class Table:
    """Printed line by line. `is_met`: no goal is missed."""

    def __init__(self, offered: Offered) -> None:
        self.offered = offered
        self.is_met = True

    def head(self) -> None:
        """The names of the columns."""
        print_line(f"{'row':38} {'Waydrop':>12} {'floor':>10} {'ratio':>7}  {'goal':12} {'load':>5}")

    def row(self, name: str, ours: str, load: float, *, floor: str = "", ratio: str = "", goal: str = "") -> None:
        """A line without a verdict."""
        print_line(f"{name:38} {ours:>12} {floor:>10} {ratio:>7}  {goal:12} {load:>5.1f}")

    def judged(self, name: str, ours: str, goal: str, *, is_met: bool, floor: str = "", ratio: str = "") -> None:
        """A line with one."""
        self.is_met = self.is_met and is_met
        self.row(name, ours, os.getloadavg()[0], floor=floor, ratio=ratio, goal=goal + ("" if is_met else "  MISSED"))


def latencies(table: Table, product: Sequence[Slice], floor: Sequence[Slice]) -> None:
    """Rows of events and states."""
    ours, bare = (_joined(slices, "after_commit_s") for slices in (product, floor))
    ratios = [
        statistics.median(one.after_commit_s) / statistics.median(other.after_commit_s)
        for one, other in zip(product, floor, strict=True)
    ]
    ratio = statistics.median(ratios)
    table.judged(
        "commit to client, median",
        _ms(statistics.median(ours)),
        f"<= {LATENCY_GOAL:g} x",
        is_met=ratio <= LATENCY_GOAL,
        floor=_ms(statistics.median(bare)),
        ratio=number(ratio),
    )
    load = statistics.median(one.load for one in product)
    for share in (95, 99):
        pair = _percentile(ours, share), _percentile(bare, share)
        table.row(f"  p{share}", _ms(pair[0]), load, floor=_ms(pair[1]), ratio=number(pair[0] / pair[1]))
    events = [_joined(slices, "after_event_s") for slices in (product, floor)]
    medians = [statistics.median(one) for one in events]
    table.row("  from before the commit, median", _ms(medians[0]), load, floor=_ms(medians[1]))
    states_s = sum(one.states for one in product) / sum(one.seconds for one in product)
    bare_s = sum(one.states for one in floor) / sum(one.seconds for one in floor)
    table.row(f"states/s at the client, of {table.offered.states_s:,.0f}", number(states_s), load, floor=number(bare_s))
    ages_s = _joined(product, "ages_s"), _joined(floor, "ages_s")
    table.row("  age of the newest, p95", _ms(_percentile(ages_s[0], 95)), load, floor=_ms(_percentile(ages_s[1], 95)))


async def caught_up(table: Table, bench: ClusterBench) -> None:
    """Rows of the relay after a partition."""
    name, goal = f"relay after {PARTITION_S:g} s without NATS, events/s", f">= {RELAY_GOAL:g} x"
    try:
        rate, whole_s, events = await bench.partition()
    except MissingError as error:
        table.judged(name, "not measured", goal, is_met=False)
        print_line(f"  {error}")
        return
    ratio = rate / table.offered.events_s
    is_met = ratio >= RELAY_GOAL
    table.judged(name, number(rate), goal, is_met=is_met, floor=number(table.offered.events_s), ratio=number(ratio))
    table.row(f"  all {events:,}, since NATS is back", f"{number(whole_s)} s", os.getloadavg()[0])


async def taken_over(table: Table, parts: Parts) -> None:
    """The row of a takeover."""
    name, goal = "takeover after kill -9", f"<= {TAKEOVER_GOAL_S:g} s"
    try:
        taken_s = await takeover_s(parts.nats.url, TAKEN_S)
    except RuntimeError as error:
        table.judged(name, "not measured", goal, is_met=False)
        print_line(f"  {error}")
        return
    table.judged(name, f"{number(taken_s)} s", goal, is_met=taken_s <= TAKEOVER_GOAL_S)


def costs(states: Slice, product: Sequence[Slice], floor: Sequence[Slice]) -> None:
    """CPU time of each part, and how many such vehicles one core has."""
    print_line(f"\n{'CPU time':12} {'1,000 states':>13} {'an event':>10} {'floor':>10}   one core is busy at")
    for name in states.cpu_s:
        state_s = states.cpu_s[name] / states.states_in_all
        event_s, bare_s = (_of_event_s(slices, name, state_s) for slices in (product, floor))
        full = 1.0 / max(state_s * STATES_OF_VEHICLE_S + event_s * EVENTS_OF_VEHICLE_S, 1e-9)
        told = f"{1e6 * state_s:>10.1f} ms {1000.0 * event_s:>7.2f} ms {1000.0 * bare_s:>7.2f} ms"
        print_line(f"{name:12} {told} {full:>12,.0f} vehicles")


def _of_event_s(slices: Sequence[Slice], name: str, state_s: float) -> float:
    spent_s = sum(one.cpu_s[name] - state_s * one.states_in_all for one in slices)
    return max(spent_s, 0.0) / sum(one.events_in_all for one in slices)


def _joined(slices: Sequence[Slice], name: str) -> list[float]:
    return [value for one in slices for value in getattr(one, name)]


def _percentile(values: Sequence[float], share: int) -> float:
    return statistics.quantiles(values, n=100)[share - 1]


def _ms(value_s: float) -> str:
    return f"{number(1000.0 * value_s)} ms"


async def measured(given: argparse.Namespace, table: Table) -> None:
    """All rows."""
    async with AsyncExitStack() as stack:
        parts = await stack.enter_async_context(running(GATEWAYS, given.vehicles, table.offered.events_s))
        http = await stack.enter_async_context(aiohttp.ClientSession())
        clients = StreamClient(http, f"{parts.node.url}/api/v1/stream"), StreamClient(http, parts.floor_url)
        for client in clients:
            stack.callback(asyncio.create_task(client.run(), name="client").cancel)
        bench = ClusterBench(parts, table.offered, *clients)
        states = await bench.slice("states", given.seconds)
        product, floor = [], []
        for _ in range(given.rounds):
            product.append(await bench.slice("product", given.seconds))
            floor.append(await bench.slice("floor", given.seconds))
        table.head()
        latencies(table, product, floor)
        for stage, spent_s in await bench.stages(given.seconds):
            table.row(f"  of it {stage}, median", _ms(spent_s), os.getloadavg()[0])
        await caught_up(table, bench)
        await taken_over(table, parts)
        if given.mavlink:
            for one in parts.gateways:
                await one.kill()
            ages_s = await position_ages_s(parts, http, given.seconds * given.rounds)
            table.row("MAVLink 2 x 15: position age p95", _ms(_percentile(ages_s, 95)), os.getloadavg()[0])
        costs(states, product, floor)


def main() -> int:
    """The exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=4.0, help="of each slice")
    parser.add_argument("--rounds", type=int, default=4, help="slices of Waydrop and of the floor")
    parser.add_argument(
        "--vehicles", type=int, default=1000, help=f"a multiple of {GATEWAYS}; states and events follow"
    )
    parser.add_argument("--mavlink", action="store_true", help="also two gateways with 15 simulated vehicles each")
    given = parser.parse_args()
    if given.vehicles < GATEWAYS or given.vehicles % GATEWAYS:
        parser.error(f"--vehicles: each of {GATEWAYS} gateways has as many")
    table, others, on = Table(Offered(given.vehicles)), machine.Others(), machine.described()
    print_line(f"{on['cores']} cores ({on['cpu']}), Python {on['python']}; load as it begins {os.getloadavg()[0]:.1f}")
    asyncio.run(measured(given, table))
    print_line(
        f"\nothers took {others.share():.0%} of the machine's CPU time; load as it ends {os.getloadavg()[0]:.1f}"
    )
    return 0 if table.is_met else 1


if __name__ == "__main__":
    sys.exit(main())
