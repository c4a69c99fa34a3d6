"""The dead-man with real processes, many times: how long until the vehicle does something else than it was told last.

Usage: python -m bench.deadman [--repeats 20] [--ways hung,killed,silent,gone]

A simulated multicopter at real time, in offboard control over the websocket. Vehicle time, from the fault on:
hung (SIGSTOP) and killed (SIGKILL): its own failsafe acts within COM_OF_LOSS_T + 0.3 s; silent: Hold by Waydrop 1 s
after the client's last word; gone (socket closed): Hold at once. Exit status 1 if one was late.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import signal
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import aiohttp

from tests.support.offboard_client import Pilot, pilot, truth
from tests.support.paths import PLANS
from tests.support.service_process import Dispatcher, ServiceProcess, until
from tests.support.simulated import SimulatedFleet

PLAN = PLANS / "clinic-run.json"
LOSS_S = 1.0
"""COM_OF_LOSS_T."""
LATEST_S = {"hung": LOSS_S + 0.3, "killed": LOSS_S + 0.3, "silent": 1.3, "gone": 0.3}


class Range:
    """One vehicle, one service, one run that is paused whenever a pilot takes over."""

    def __init__(self, fleet: SimulatedFleet, service: ServiceProcess, http: aiohttp.ClientSession) -> None:
        self.fleet = fleet
        self.service = service
        self.http = http
        self.dispatcher = Dispatcher(http, service.url)
        self.run_id = ""
        self.busy = 0

    async def take_off(self) -> None:
        """A run, paused in the air."""
        await self.dispatcher.until_vehicles(1)
        self.run_id = await self.dispatcher.fly(json.loads(PLAN.read_text()), "v1")
        await until(lambda: truth(self.fleet), lambda v: v["height_m"] > 12.0, "it must climb", 60)

    async def paused(self) -> None:
        """The run is paused, whatever the vehicle did before."""
        await self.dispatcher.until_vehicles(1)
        await until(self._pause, lambda status: status == 200, "the run must be taken up and paused", 30)
        await self.dispatcher.until_run(self.run_id, lambda r: r["state"] == "paused", "it must pause", 30)

    async def _pause(self) -> int:
        async with self.http.post(f"{self.service.url}/api/v1/runs/{self.run_id}/pause", json={}) as answer:
            return 200 if answer.ok else answer.status

    async def once(self, way: str) -> float:
        """One fault; vehicle seconds until the vehicle left OFFBOARD."""
        await self.paused()
        async with pilot(self.http, self.service.url) as ann:
            ann.setpoint = {"type": "velocity_ned", "north_m_s": 0.5, "east_m_s": 0.0}
            if not await self._entered(ann):
                return await self.once(way)
            began_s = await self._fault(way, ann)
            left = await self._left_offboard(way)
        if way == "hung":
            os.kill(self.service.pid, signal.SIGCONT)
        if way == "killed":
            self.service.start()
        return float(left["time_s"]) - began_s

    async def _entered(self, ann: Pilot) -> bool:
        """False if the machine was so busy that Waydrop stood still on the way in, and so dropped the lease."""
        try:
            await ann.enter()
            await asyncio.sleep(0.5)
        except AssertionError:
            reason = ann.offboard.get("reason") or {}
            if reason.get("code") != "offboard.stood_still":
                raise
        self.busy += ann.offboard["state"] != "active"
        return bool(ann.offboard["state"] == "active")

    async def _fault(self, way: str, ann: Pilot) -> float:
        before = await truth(self.fleet)
        if way == "hung":
            os.kill(self.service.pid, signal.SIGSTOP)
        elif way == "killed":
            self.service.kill()
        elif way == "silent":
            ann.fall_silent()
        else:
            await ann.leave()
        return float(before["time_s"])

    async def _left_offboard(self, way: str) -> dict[str, Any]:
        found: dict[str, Any] = await until(
            lambda: truth(self.fleet), lambda v: v["mode"] != "OFFBOARD", f"{way}: the vehicle must leave OFFBOARD", 30
        )
        if found["mode"] != "LOITER":
            raise AssertionError(f"{way}: the vehicle is in {found['mode']}, not in LOITER")
        return found


async def main(ways: Sequence[str], repeats: int) -> int:
    """All ways; the exit status."""
    late = 0
    with (
        tempfile.TemporaryDirectory() as folder,
        SimulatedFleet("quad", params="COM_OBL_RC_ACT=5") as fleet,
        ServiceProcess(Path(folder), fleet.connections) as service,
    ):
        async with aiohttp.ClientSession(timeout=aiohttp.ClientTimeout(total=60)) as http:
            field = Range(fleet, service, http)
            await field.take_off()
            for way in ways:
                field.busy = 0
                took = sorted([await field.once(way) for _ in range(repeats)])
                beyond = sum(seconds > LATEST_S[way] for seconds in took)
                late += beyond
                sys.stdout.write(
                    f"{way:7} n {repeats:3}  min {took[0]:.2f}  p50 {took[len(took) // 2]:.2f}  max {took[-1]:.2f} s "
                    f"of vehicle time, at most {LATEST_S[way]:.1f}: {beyond} late ({field.busy} anew: busy machine)\n"
                )
                sys.stdout.flush()
    return 1 if late else 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--ways", default="hung,killed,silent,gone")
    given = parser.parse_args()
    sys.exit(asyncio.run(main(given.ways.split(","), given.repeats)))
