"""Every simulated fault in every phase of a run, in both drop modes: no unsafe move, every drop told as it was.

Usage: python -m tests.campaigns.faults [--flights 0] [--only TEXT] [--seconds 0] [--vehicles 12] [--seed N]

Without --flights all combinations are flown, several vehicles at once, each batch with a service and simulated
vehicles of its own. In each flight one fault strikes in one phase; what the vehicle really did comes from the
simulator.

What counts as an unsafe move, by the simulator's account:

- The vehicle is armed although no start was asked for, or a second time after one start.
- After a pilot at the sticks has changed the mode, Waydrop changes it again.
- The parcel is released twice; or, supervised, farther than OFFSET_M from its point, faster than SPEED_M_S, outside of
  Mission mode, or after a pilot has taken over.

And what else must hold:

- A drop's outcome is what happened (released, kept), or `unknown`. One exception: an autopilot whose gripper is stuck
  acknowledges the release, and nothing on the link shows that it did not move (docs/reference/simulator.md). There
  `released` may be told by the acknowledgement or inferred; it is counted apart.
- Every run ends, or its start is refused with a documented problem and its vehicle stays disarmed. A run that is paused
  because somebody else holds the vehicle ends when they land it.
- The journal's chain is intact, and the service logs no defect.

Exit status 1 if anything fell.
"""

from __future__ import annotations

import argparse
import asyncio
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any, Final

import aiohttp

from app.storage import verify_journal
from tests.support.forked_service import ForkedService
from tests.support.plan_pieces import RETURN, gripper, plan_json, takeoff, waypoint, winch
from tests.support.service_process import Dispatcher
from tests.support.simulated import SimulatedFleet
from tests.support.simulator_truth import Truth, Truths, watched_truth

SPEED: Final = 4.0
PARAMS: Final = "COM_LOW_BAT_ACT=3,COM_DISARM_PRFLT=20.0,RTL_RETURN_ALT=12.0"
OFFSET_M: Final = 5.0
"""A drop's own tolerance is 3 m; the simulator is looked at every 0.2 s of vehicle time."""
SPEED_M_S: Final = 1.5
NORTH_M, HEIGHT_M = 40.0, 12.0
PHASE_S: Final = 90.0
RUN_S: Final = 150.0
DOWN_S: Final = 60.0
OVER: Final = frozenset({"completed", "aborted", "failed", "lost"})
PILOTS: Final = ("RTL", "POSCTL", "LAND")

Strike = Callable[[random.Random], tuple[Any, Any]]
"""The value of a fault, and the one that ends it after CUT_S; None: it stays."""
CUT_S: Final = 8.0
FAULTS: Final[dict[str, Strike]] = {
    "loss": lambda chance: (chance.choice([0.1, 0.4]), None),
    "duplicate": lambda chance: (0.5, None),
    "reorder": lambda chance: (0.5, None),
    "delay_s": lambda chance: (chance.choice([0.1, 0.5]), None),
    "jitter_s": lambda chance: (0.3, None),
    "link_cut": lambda chance: (True, False),
    "reboot": lambda chance: (True, None),
    "refuse_upload": lambda chance: (4, None),
    "lost_ack": lambda chance: (chance.randint(1, 3), None),
    "stuck_gripper": lambda chance: (True, None),
    "no_gripper": lambda chance: (True, None),
    "slow_gripper": lambda chance: (3.0, None),
    "stuck_winch": lambda chance: (True, None),
    "gps_loss": lambda chance: (True, chance.choice([None, False])),
    "range_loss": lambda chance: (True, None),
    "battery_percent": lambda chance: (6.0, None),
    "wind": lambda chance: ([chance.uniform(-6, 6), chance.uniform(-6, 6)], None),
    "mode": lambda chance: (chance.choice(PILOTS), None),
    "second_gcs": lambda chance: (chance.choice(["upload", "clear", "open_transfer"]), None),
    "duplicate_sysid": lambda chance: (True, False),
}


@dataclass(frozen=True)
class Phase:
    """`begun`: whether the flight is in it. `before` one: 0 the run is made, 1 it is started, 2 it flies."""

    name: str
    before: int = 2
    begun: Callable[[Truth], bool] = lambda truth: True


PHASES: Final = (
    Phase("upload", before=0),
    Phase("uploaded", before=1),
    Phase("takeoff", begun=lambda truth: truth.armed and truth.height_m > 2),
    Phase("way to the drop", begun=lambda truth: truth.armed and truth.north_m > NORTH_M / 3),
    Phase("drop", begun=lambda truth: truth.armed and abs(truth.north_m - NORTH_M) < 2 and truth.speed_m_s < 1),
    Phase("release", begun=lambda truth: truth.releases > 0),
    Phase("return", begun=lambda truth: truth.armed and truth.mode == "RTL" and truth.north_m < NORTH_M / 2),
    Phase("landing", begun=lambda truth: truth.armed and truth.mode == "RTL" and truth.height_m < HEIGHT_M / 3),
)


@dataclass(frozen=True)
class Flight:
    """What is flown and what strikes."""

    fault: str
    phase: Phase
    supervised: bool

    @property
    def by_winch(self) -> bool:
        return self.fault == "stuck_winch"

    @property
    def name(self) -> str:
        return f"{self.fault} in {self.phase.name}, {'supervised' if self.supervised else 'embedded'}"

    def plan(self) -> dict[str, Any]:
        """Out to the drop and back."""
        mode = {"hold_s": 30.0} if self.supervised else {"mode": "embedded"}
        drop = (winch if self.by_winch else gripper)(**mode)
        place = waypoint(NORTH_M, 0, HEIGHT_M, **({} if self.supervised else {"hold_s": 5}))
        return plan_json("multicopter", takeoff(HEIGHT_M), place, drop, RETURN)


EVERY: Final = tuple(
    Flight(fault, phase, supervised) for fault, phase, supervised in product(FAULTS, PHASES, (True, False))
)


@dataclass
class Found:
    """What was flown, and what fell."""

    flights: int = 0
    outcomes: Counter[str] = field(default_factory=Counter)
    refused: Counter[str] = field(default_factory=Counter)
    trusted: int = 0
    """Stuck grippers whose acknowledgement was believed."""
    failures: list[str] = field(default_factory=list)


class Trial:
    """One flight."""

    def __init__(
        self, number: int, flight: Flight, fleet: SimulatedFleet, dispatcher: Dispatcher, truth: Truth, found: Found
    ) -> None:
        self._number = number
        self._flight = flight
        self._fleet = fleet
        self._dispatcher = dispatcher
        self._truth = truth
        self._found = found
        self._started = 0
        self._pilot: str | None = None

    async def fly(self, chance: random.Random) -> None:
        """From the plan to the vehicle on the ground; what is wrong is noted."""
        plan, phase = await self._dispatcher.post("/plans", self._flight.plan()), self._flight.phase
        order = {"plan": plan["id"], "vehicle": f"v{self._number}", "start": False}
        strike = asyncio.create_task(self._strike(chance)) if phase.before == 0 else None
        if strike is not None:
            await asyncio.sleep(0.2)
        run_id = await self._told("/runs", order)
        if run_id is not None and await self._uploaded(run_id):
            if phase.before == 1:
                strike = asyncio.create_task(self._strike(chance))
                await asyncio.sleep(0.2)
            if await self._told(f"/runs/{run_id}/start", None) is not None:
                self._started += 1
                strike = strike or asyncio.create_task(self._strike_in_flight(chance))
                await self._end(run_id)
        if strike is not None:
            strike.cancel()
            await asyncio.gather(strike, return_exceptions=True)
        self._found.flights += 1
        self._judge_moves()

    async def _told(self, path: str, body: Any) -> str | None:
        """The run's id; None if that was refused."""
        try:
            return str((await self._dispatcher.post(path, body))["id"])
        except AssertionError as error:
            self._found.refused[self._flight.fault] += 1
            if " 500 " in str(error):
                self._fell(str(error))
            return None

    async def _uploaded(self, run_id: str) -> bool:
        run = await self._dispatcher.until_run(
            run_id, lambda run: run["state"] == "uploaded" or run["state"] in OVER, "it must be uploaded", PHASE_S
        )
        return run["state"] == "uploaded"

    async def _strike_in_flight(self, chance: random.Random) -> None:
        async with asyncio.timeout(PHASE_S):
            while not self._flight.phase.begun(self._truth):
                await asyncio.sleep(0.02)
        await self._strike(chance)

    async def _strike(self, chance: random.Random) -> None:
        value, end = FAULTS[self._flight.fault](chance)
        self._truth.forget_modes()
        await self._set(value)
        if self._flight.fault == "mode":
            self._pilot = value
        if end is not None:
            await asyncio.sleep(CUT_S)
            await self._set(end)

    async def _set(self, value: Any) -> None:
        await asyncio.to_thread(self._fleet.control, self._flight.fault, value, system_id=self._number)

    async def _set_mode(self, mode: str) -> None:
        await asyncio.to_thread(self._fleet.control, "mode", mode, system_id=self._number)

    async def _end(self, run_id: str) -> None:
        try:
            run = await self._dispatcher.until_run(run_id, _is_at_rest, "the run must end", RUN_S)
            if run["state"] == "paused":
                await self._set_mode("LAND")
                run = await self._dispatcher.until_run(
                    run_id, lambda run: run["state"] in OVER, "it must end landed", RUN_S
                )
        except AssertionError as error:
            self._fell(str(error))
            return
        if run["state"] == "uploaded":
            self._found.refused[self._flight.fault] += 1
            if self._truth.armed:
                self._fell(f"its start is refused and it is armed: {run}")
            return
        deadline_s = time.monotonic() + DOWN_S
        while self._truth.armed and time.monotonic() < deadline_s:
            await asyncio.sleep(0.1)
        self._judge_drop(run, (await self._dispatcher.get(f"/runs/{run_id}"))["drops"][0])

    def _judge_drop(self, run: dict[str, Any], drop: dict[str, Any]) -> None:
        outcome, released = drop["outcome"], self._truth.releases > 0
        self._found.outcomes[f"{run['state']} {outcome}"] += 1
        if outcome == "unknown" or (outcome == "released") == released:
            return
        if outcome == "released" and self._flight.fault == "stuck_gripper" and drop["certainty"] != "sensed":
            self._found.trusted += 1
            return
        self._fell(f"told is {outcome}, and {self._truth.releases} were released: {run['state']}, {drop}")

    def _judge_moves(self) -> None:
        truth = self._truth
        if truth.flights > self._started:
            self._fell(f"unsafe move: armed {truth.flights} times, asked for {self._started}")
        if truth.releases > 1:
            self._fell(f"unsafe move: released {truth.releases} times")
        if self._pilot in truth.modes:
            after = truth.modes[truth.modes.index(self._pilot) :]
            if after not in ([self._pilot], [self._pilot, "RTL"], [self._pilot, "LAND"]):  # what PX4 itself does later
                self._fell(f"unsafe move: after the pilot's {self._pilot} the modes were {after}")
        if truth.release is not None and self._flight.supervised and not self._flight.by_winch:
            self._judge_release(truth.release)

    def _judge_release(self, release: dict[str, Any]) -> None:
        off_m = abs(release["north_m"] - NORTH_M)
        if off_m > OFFSET_M or release["ground_speed_m_s"] > SPEED_M_S or release["mode"] != "MISSION":
            self._fell(f"unsafe move: released {off_m:.1f} m off: {release}")

    def _fell(self, how: str) -> None:
        self._found.failures.append(f"{self._flight.name}: {how}")


def _is_at_rest(run: Any) -> bool:
    """Whether a run that was started is over, somebody else holds its vehicle, or its start was refused.

    A refused start leaves the run uploaded, with the reason.
    """
    reason = run["reason"] or {"code": "", "params": {}}
    refused = run["state"] == "uploaded" and "error" in reason["params"]
    held = run["state"] == "paused" and reason["code"] == "run.taken_by_others"
    coming_down = reason["params"].get("mode") in ("return", "land")
    return run["state"] in OVER or refused or (held and not coming_down)


async def batch(folder: Path, flights: Sequence[Flight], chance: random.Random, found: Found) -> None:
    """Each flight with a vehicle of its own, all at once, and one service."""
    kinds = ",".join("quad:winch=1" if flight.by_winch else "quad" for flight in flights)
    with (
        SimulatedFleet(kinds, speed=SPEED, params=PARAMS, seed=chance.randrange(1_000_000)) as fleet,
        ForkedService(folder, fleet.connections) as service,
    ):
        async with aiohttp.ClientSession() as http, watched_truth(fleet.control_port) as truths:
            dispatcher = Dispatcher(http, service.url)
            await dispatcher.until_vehicles(len(flights), 90)
            await asyncio.gather(
                *(
                    _trial(number, flight, fleet, dispatcher, truths, found, chance.random())
                    for number, flight in enumerate(flights, start=1)
                )
            )
        log = service.log_path.read_text(errors="replace")
    found.failures += [f"logged: {line}" for line in log.splitlines() if '"defect' in line or "Traceback" in line]
    altered = (await verify_journal(folder / "waydrop.db")).alterations
    found.failures += [f"the journal was altered: {one}" for one in altered]


async def _trial(
    number: int,
    flight: Flight,
    fleet: SimulatedFleet,
    dispatcher: Dispatcher,
    truths: Truths,
    found: Found,
    seed: float,
) -> None:
    try:
        await Trial(number, flight, fleet, dispatcher, truths.by_id[number], found).fly(random.Random(seed))
    except (AssertionError, TimeoutError) as error:
        found.failures.append(f"{flight.name}: {error!r}")


async def campaign(folder: Path, given: argparse.Namespace) -> Found:
    """All of them, or a sample."""
    found, chance, began_s = Found(), random.Random(given.seed), time.monotonic()
    flights = [flight for flight in EVERY if given.only in flight.name]
    chance.shuffle(flights)
    if given.flights:
        flights = flights[: given.flights]
    for number, first in enumerate(range(0, len(flights), given.vehicles)):
        if given.seconds and time.monotonic() - began_s > given.seconds:
            break
        await batch(folder / str(number), flights[first : first + given.vehicles], chance, found)
        print(f"{found.flights} of {len(flights)} after {time.monotonic() - began_s:.0f} s", flush=True)
    return found


def main() -> None:
    """Run it and print what was found."""
    parser = argparse.ArgumentParser(description="every fault in every phase of a run, in both drop modes")
    parser.add_argument("--flights", type=int, default=0, help="a sample of so many; 0: all")
    parser.add_argument("--only", default="", help='the flights whose name contains this, as in "loss in upload"')
    parser.add_argument("--seconds", type=float, default=0.0, help="begin no batch after so long")
    parser.add_argument("--vehicles", type=int, default=12, help="flights at once; 15 at most")
    parser.add_argument("--seed", type=int, default=random.randrange(1_000_000))
    given = parser.parse_args()
    print(f"seed {given.seed}", flush=True)
    with tempfile.TemporaryDirectory(prefix="waydrop-faults-") as folder:
        found = asyncio.run(campaign(Path(folder), given))
    print("\n".join(found.failures))
    print(f"drops: {', '.join(f'{how}: {count}' for how, count in sorted(found.outcomes.items()))}")
    print(f"refused: {', '.join(f'{fault}: {count}' for fault, count in sorted(found.refused.items())) or 'nothing'}")
    print(f"stuck grippers whose acknowledgement was believed: {found.trusted}")
    print(f"{found.flights} flights of {len(EVERY)} combinations: {len(found.failures)} failures")
    sys.exit(bool(found.failures or found.flights == 0))


if __name__ == "__main__":
    main()
