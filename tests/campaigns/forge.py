"""A forger on three vehicle links, open, pinned and signed, in every phase of a run.

Usage: python -m tests.campaigns.forge [--speed 3] [--rounds 1]

The service and three simulated vehicles are processes of their own. The forger reaches each vehicle's port from another
address: it listens, answers in the vehicle's name, floods, and takes identities: unsigned, signed with another key, and
with frames that it recorded before. What it achieves is judged by the API and by the simulated vehicles' truth. It
fails if that differs, for any link, from the table in docs/explanation/security.md: if something unlisted is achieved,
or something listed no longer holds. It also fails if on the pinned or the signed link a command is lost, or the run
ends otherwise than the vehicle's truth.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import re
import socket
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import aiohttp
from pymavlink.dialects.v20 import common as mavlink

from app.vehicles.link_guard import frames
from tests.support.mavlink_frames import FrameSender, timestamp_of
from tests.support.paths import ROOT
from tests.support.service_process import Dispatcher, ServiceProcess
from tests.support.simulated import SimulatedFleet

LEVELS: Final = ("open", "pinned", "signed")
FORGER: Final = "127.0.0.66"
KEY: Final = bytes(range(32))
OURS: Final = (245, 190)
MOST_SYSTEMS: Final = 5
"""Of each connection, so that phantoms stay few."""
WAIT_S: Final = 60.0
PLACE: Final = {"latitude_deg": 47.397742, "longitude_deg": 8.546494, "relative_altitude_m": 10}
PLAN: Final[dict[str, Any]] = {
    "version": 1,
    "name": "forged",
    "vehicle_type": "multicopter",
    "contingency": {"on_drop_failure": "return"},
    "items": [
        {"id": "takeoff", "type": "takeoff", "relative_altitude_m": 10},
        {"id": "clinic", "type": "waypoint", **PLACE},
        {"id": "drop", "type": "gripper", "action": "release", "release_motion": "stopped", "max_offset_m": 2},
        {"id": "home", "type": "return_to_launch"},
    ],
}
DOCUMENT: Final = ROOT / "docs/explanation/security.md"
GOALS: Final[Mapping[str, str]] = {
    "hear": "before the upload",
    "show_state": "before the upload",
    "show_position": "before the upload",
    "say": "before the upload",
    "quarantine": "before the upload",
    "add_vehicles": "before the upload",
    "fail_upload": "uploading",
    "refuse_start": "starting",
    "reach_item": "flying",
    "end_run": "flying",
    "displace": "flying",
    "blur_release": "at the drop",
    "forge_release": "at the drop",
    "forge_landing": "returning",
    "change_ended_run": "landed",
}
RADIO_S: Final[Mapping[str, float]] = {"open": 0.3, "pinned": 0.1, "signed": 0.1}
"""A vehicle answers as late as over a radio, so a forger who answers first is first, on the open link always. On the
others no command may be lost.
"""
OVER: Final = ("completed", "aborted", "failed", "lost")
Message = Any
"""pymavlink has no types."""


@dataclass
class Found:
    """What was achieved of each goal on each link, and what fell beside that."""

    achieved: dict[str, set[str]] = field(default_factory=lambda: {goal: set() for goal in GOALS})
    failures: list[str] = field(default_factory=list)
    sent: int = 0
    commands: int = 0


class Forger:
    """Speaks for one vehicle on its link, from an address of its own, in every way that it has."""

    def __init__(self, port: int, system: int, *, recorded_key: bytes | None) -> None:
        self._to = ("127.0.0.1", port)
        self._system = system
        self._sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._sock.setblocking(False)
        self._sock.bind((FORGER, 0))
        self._speakers = [FrameSender(system), FrameSender(system, key=b"x" * 32)]
        if recorded_key is not None:  # what was recorded an hour ago
            self._speakers.append(FrameSender(system, key=recorded_key, timestamp=timestamp_of(time.time() - 3600)))
        self.sent = 0
        self.heard = 0

    def say(self, *messages: Message, packed: Iterable[bytes] = ()) -> None:
        """Each message in each way, and frames as they are."""
        for frame in packed:
            self._send(frame)
        for message in messages:
            for speaker in self._speakers:
                self._send(speaker.pack(message))
        self._listen()

    def take(self, systems: Iterable[int]) -> None:
        """Say HEARTBEAT as each of these systems."""
        for system in systems:
            self._send(FrameSender(system).heartbeat())
        self._send(FrameSender(self._system).ping())
        self._listen()

    def close(self) -> None:
        """Be gone."""
        self._sock.close()

    def _send(self, frame: bytes) -> None:
        with contextlib.suppress(OSError):
            self._sock.sendto(frame, self._to)
            self.sent += 1

    def _listen(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while True:
                data = self._sock.recv(65_535)
                self.heard += sum(frames.target_system(frame) == self._system for frame in frames.split(data))


@asynccontextmanager
async def going_on(say: Callable[[], None], every_s: float = 0.02) -> AsyncIterator[None]:
    """Say it again and again while the block runs."""

    async def repeat() -> None:
        while True:
            say()
            await asyncio.sleep(every_s)

    saying = asyncio.create_task(repeat(), name="forger")
    try:
        yield
    finally:
        saying.cancel()
        await asyncio.gather(saying, return_exceptions=True)


AHEAD_MS = 100_000_000


def heartbeat(*, armed: bool) -> Message:
    """A quadrotor in Hold."""
    return mavlink.MAVLink_heartbeat_message(2, 12, 29 | (128 if armed else 0), 4 << 16 | 3 << 24, 4, 3)


def position(north_deg: float) -> Message:
    """At rest, so far north of home, by a clock ahead of the vehicle's: one that is behind is not believed."""
    boot_ms = AHEAD_MS + round(time.monotonic() * 1e3) % AHEAD_MS
    lat, lon = round((47.397742 + north_deg) * 1e7), round(8.545594 * 1e7)
    return mavlink.MAVLink_global_position_int_message(boot_ms, lat, lon, 488_000, 0, 0, 0, 0, 0)


def landed() -> Message:
    """EXTENDED_SYS_STATE: on the ground."""
    return mavlink.MAVLink_extended_sys_state_message(0, 1)


def ack(command: int, result: int) -> Message:
    """COMMAND_ACK to Waydrop."""
    return mavlink.MAVLink_command_ack_message(command, result, 100, 0, *OURS)


class Attack:
    """One link, from the first phase to the last."""

    def __init__(self, level: str, system: int, fleet: SimulatedFleet, dispatcher: Dispatcher, found: Found) -> None:
        self.level, self.system, self.vehicle = level, system, f"v{system}"
        self.connection = f"udpin://127.0.0.1:{fleet.port + system - 1}"
        self._fleet, self._dispatcher, self._found = fleet, dispatcher, found
        self._forger = Forger(fleet.port + system - 1, system, recorded_key=KEY if level == "signed" else None)

    async def all_phases(self) -> None:
        """Forge from before the upload until after the landing."""
        try:
            await self._before()
            run_id = await self._uploading()
            for phase in (self._starting, self._flying, self._at_the_drop, self._returning, self._landed):
                await phase(run_id)
        finally:
            self._found.sent += self._forger.sent
            self._forger.close()

    # the phases -----------------------------------------------------------------------------------------------

    async def _before(self) -> None:
        def lie() -> None:
            forged = (heartbeat(armed=True), position(0.09), text("forged by the forger"))
            self._forger.say(*forged)
            self._forger.take(number for number in (*range(1, 4), *range(40, 60)) if number != self.system)

        async with going_on(lie, 0.05):
            await self._look("show_state", self._view_says(lambda view: bool(view["state"]["armed"])))
            await self._look(
                "show_position", self._view_says(lambda view: (view["state"]["latitude_deg"] or 0) > 47.45)
            )
            await self._look("say", self._text_is_recorded)
            await self._look("add_vehicles", self._has_phantoms)
            await self._look("hear", self._hears)
            await self._look("quarantine", self._view_says(lambda view: view["quarantined"] is not None))
        if (count := await self._vehicles_here()) > MOST_SYSTEMS:
            self._fail(f"{count} vehicles on one connection that takes {MOST_SYSTEMS}")
        if "quarantine" in self._achieved():
            await self._dispatcher.post(f"/vehicles/{self.vehicle}/end-quarantine")
        await self._until_at_rest()

    async def _uploading(self) -> str:
        self._fleet.control("delay_s", RADIO_S[self.level], system_id=self.system)
        refusals = [mavlink.MAVLink_mission_ack_message(*OURS, 1, kind) for kind in range(3)]
        async with going_on(lambda: self._forger.say(*refusals)):
            run_id = await self._created()
            run = await self._reaches(run_id, "uploaded", *OVER)
        if run["state"] != "uploaded":
            self._achieve("fail_upload")
            run_id = await self._created()
            await self._reaches(run_id, "uploaded")
        return run_id

    async def _starting(self, run_id: str) -> None:
        async with going_on(lambda: self._forger.say(ack(400, 2), ack(176, 2))):
            await self._dispatcher.post(f"/runs/{run_id}/start")
            await asyncio.sleep(1.0)
            run = await self._reaches(run_id, "uploaded", "flying", *OVER)
        if run["state"] == "flying":
            return
        self._achieve("refuse_start")
        async with asyncio.timeout(WAIT_S):  # it was armed in truth, and disarms by itself
            while self._truth()["armed"] or (await self._view())["state"]["armed"]:
                await asyncio.sleep(0.1)
        await self._dispatcher.post(f"/runs/{run_id}/start")
        await self._reaches(run_id, "flying")

    async def _flying(self, run_id: str) -> None:
        self._fleet.control("no_gripper", True, system_id=self.system)
        last = len(PLAN["items"])

        def lie() -> None:
            self._forger.say(mavlink.MAVLink_mission_item_reached_message(last))
            self._forger.say(heartbeat(armed=False), landed())

        async with going_on(lie, 0.05):
            await asyncio.sleep(2.0)
            run = await self._run(run_id)
        self._note("reach_item", self._is_ahead(run))
        self._note("end_run", run["state"] in OVER)
        if run["state"] in OVER:
            self._fail(f"the run is {run['state']} in flight: {run['reason']}")
        await self._flood(run_id)

    async def _flood(self, run_id: str) -> None:
        """More frames than a link carries, and two commands meanwhile."""
        texts = [text(f"flood {number}") for number in range(40)]
        radio = [FrameSender(self.system).radio_status()] * 200  # passes unsigned, from the vehicle's peer
        before = await self._refused("too_fast")
        async with going_on(lambda: self._forger.say(*texts, packed=[*radio, b"".join(radio * 12)]), 0.01):
            await asyncio.sleep(0.6)
            if self.level != "open":
                for action, state in (("pause", "paused"), ("resume", "flying")):
                    await self._command(run_id, action, state)
            await asyncio.sleep(0.6)
        self._note("displace", await self._refused("too_fast") > before)

    async def _at_the_drop(self, run_id: str) -> None:
        moved = mavlink.MAVLink_servo_output_raw_message(77, 1, *[1000] * 8)
        also = mavlink.MAVLink_servo_output_raw_message(77, 0, *[1000] * 8)
        async with going_on(lambda: self._forger.say(ack(211, 0), moved, also)):
            run = await self._dispatcher.until_run(
                run_id, lambda one: one["state"] in OVER or one["drops"][0]["outcome"] != "pending", "a drop", WAIT_S
            )
        outcome = run["drops"][0]["outcome"]
        if self._truth()["gripper_open"]:
            self._fail("the gripper must have stayed closed")
        self._note("forge_release", outcome == "released")
        self._note("blur_release", outcome == "unknown")

    async def _returning(self, run_id: str) -> None:
        def lie() -> None:
            self._forger.say(heartbeat(armed=False), landed(), position(0.0))

        forged = False
        async with going_on(lie, 0.05):
            until_s = time.monotonic() + 2.0
            while time.monotonic() < until_s and self._truth()["armed"] and not forged:
                ended = (await self._run(run_id))["state"] in OVER
                forged = ended and bool(self._truth()["armed"])
        self._note("forge_landing", forged)
        if self.level == "open":
            return  # what it made of the vehicle's identity is in the table
        await self._command(run_id, "land", "landing")

    async def _landed(self, run_id: str) -> None:
        if self.level == "open" and (await self._run(run_id))["state"] not in OVER:
            with contextlib.suppress(AssertionError):
                await self._dispatcher.post(f"/runs/{run_id}/land")
        run = await self._reaches(run_id, *OVER)
        async with going_on(lambda: self._forger.say(heartbeat(armed=True), ack(211, 0), ack(400, 0)), 0.05):
            await asyncio.sleep(0.5)
            later = await self._run(run_id)
        self._note("change_ended_run", later != run)
        report = await self._dispatcher.get(f"/runs/{run_id}/delivery-report")
        if report["link_security"] != self.level:
            self._fail(f"the delivery report says {report['link_security']}")
        if self.level == "open":
            return
        if run["drops"][0]["outcome"] != "kept":
            self._fail(f"the drop is {run['drops'][0]['outcome']}, and the gripper never opened")
        if (view := await self._view())["quarantined"] or not view["state"]["connected"]:
            self._fail(f"the vehicle was taken away: {view}")

    # what is looked at ----------------------------------------------------------------------------------------

    def _view_says(self, what: Callable[[Any], bool]) -> Callable[[], Awaitable[bool]]:
        async def look() -> bool:
            return what(await self._view())

        return look

    async def _text_is_recorded(self) -> bool:
        after = 0
        while events := (await self._dispatcher.get(f"/events?after={after}&limit=500"))["events"]:
            after = events[-1]["seq"]
            own = (one for one in events if one["kind"] == "vehicle.status_text" and one["vehicle_id"] == self.vehicle)
            if any("forger" in one["data"]["text"] for one in own):
                return True
        return False

    async def _vehicles_here(self) -> int:
        vehicles = (await self._dispatcher.get("/vehicles"))["vehicles"]
        return sum(one["connection"] == self.connection for one in vehicles)

    async def _has_phantoms(self) -> bool:
        return await self._vehicles_here() > 1

    async def _hears(self) -> bool:
        return self._forger.heard > 0

    async def _refused(self, reason: str) -> float:
        text_ = await self._dispatcher.text("/metrics")
        pattern = rf'waydrop_link_refused_total\{{connection="{re.escape(self.connection)}",reason="{reason}"\}} (\S+)'
        return sum(float(one) for one in re.findall(pattern, text_))

    def _is_ahead(self, run: Any) -> bool:
        """Whether more items count as flown than the vehicle has flown."""
        return len(run["flown_item_ids"]) > int(self._truth()["mission_seq"]) + 1

    @staticmethod
    def _is_at_rest(view: Any) -> bool:
        state = view["state"]
        return (
            state["armed"] is False and abs((state["latitude_deg"] or 0) - 47.397742) < 0.01 and not view["quarantined"]
        )

    # what is done ---------------------------------------------------------------------------------------------

    async def _created(self) -> str:
        plan = await self._dispatcher.post("/plans", PLAN)
        run = await self._dispatcher.post("/runs", {"plan": plan["id"], "vehicle": self.vehicle, "start": False})
        return str(run["id"])

    async def _command(self, run_id: str, action: str, state: str) -> None:
        """A command that must not be lost."""
        self._found.commands += 1
        try:
            await self._dispatcher.post(f"/runs/{run_id}/{action}")
            await self._reaches(run_id, state, *OVER)
        except AssertionError as error:
            self._fail(f"{action} was lost: {error}")

    async def _reaches(self, run_id: str, *states: str) -> Any:
        return await self._dispatcher.until_run(run_id, lambda run: run["state"] in states, f"run in {states}", WAIT_S)

    async def _run(self, run_id: str) -> Any:
        return await self._dispatcher.get(f"/runs/{run_id}")

    async def _view(self) -> Any:
        return await self._dispatcher.get(f"/vehicles/{self.vehicle}")

    def _truth(self) -> Any:
        return self._fleet.truth(self.system)

    async def _look(self, goal: str, what: Callable[[], Awaitable[bool]], within_s: float = 0.3) -> None:
        """Note the goal as soon as it is seen."""
        until_s = time.monotonic() + (20.0 if self.level == "open" else within_s)
        while time.monotonic() < until_s:
            if await what():
                self._achieve(goal)
                return
            await asyncio.sleep(0.05)

    async def _until_at_rest(self) -> None:
        async with asyncio.timeout(WAIT_S):
            while not self._is_at_rest(await self._view()):
                await asyncio.sleep(0.1)

    def _achieved(self) -> set[str]:
        return {goal for goal, levels in self._found.achieved.items() if self.level in levels}

    def _note(self, goal: str, is_achieved: bool) -> None:
        if is_achieved:
            self._achieve(goal)

    def _achieve(self, goal: str) -> None:
        self._found.achieved[goal].add(self.level)

    def _fail(self, what: str) -> None:
        self._found.failures.append(f"{self.level} link: {what}")


def text(words: str) -> Message:
    """STATUSTEXT."""
    return mavlink.MAVLink_statustext_message(6, words.encode(), 0, 0)


def listed() -> dict[str, set[str]]:
    """On which links docs/explanation/security.md says that a forger achieves each goal."""
    rows = re.findall(r"^\| `(\w+)` \|[^|]*\| (yes|no) \| (yes|no) \| (yes|no) \|$", DOCUMENT.read_text(), re.MULTILINE)
    return {goal: {level for level, mark in zip(LEVELS, marks, strict=True) if mark == "yes"} for goal, *marks in rows}


async def campaign(folder: Path, speed: float, found: Found) -> None:
    """All phases on all links at once."""
    keys = folder / "link-keys.json"
    keys.touch(mode=0o600)
    keys.write_text(json.dumps({"version": 1, "vehicles": {3: [{"secret": KEY.hex(), "in_use": True}]}}))
    with SimulatedFleet(f"quad,quad,quad:key={keys}", speed=speed) as fleet:
        options = (f"?peer=any&most_systems={MOST_SYSTEMS}", *[f"?most_systems={MOST_SYSTEMS}"] * 2)
        links = [url + more for url, more in zip(fleet.connections, options, strict=True)]
        with ServiceProcess(folder, links, WAYDROP_LINK_KEYS=str(keys)) as service:
            async with aiohttp.ClientSession() as http:
                dispatcher = Dispatcher(http, service.url)
                await dispatcher.until_vehicles(3)
                attacks = [Attack(level, number, fleet, dispatcher, found) for number, level in enumerate(LEVELS, 1)]
                done = await asyncio.gather(*(one.all_phases() for one in attacks), return_exceptions=True)
            found.failures += [
                f"{one.level} link: {type(error).__name__}: {error}"
                for one, error in zip(attacks, done, strict=True)
                if error is not None
            ]


def verdict(found: Found) -> list[str]:
    """Print the table, and return what differs from what is listed."""
    wanted, differences = listed(), []
    print(f"{'goal':18}{'phase':20}{'open':>8}{'pinned':>8}{'signed':>8}")
    for goal, phase in GOALS.items():
        marks = ["yes" if level in found.achieved[goal] else "no" for level in LEVELS]
        print(f"{goal:18}{phase:20}" + "".join(f"{mark:>8}" for mark in marks))
        if found.achieved[goal] != wanted.get(goal):
            is_listed = sorted(wanted[goal]) if goal in wanted else "nowhere"
            differences.append(f"{goal}: achieved on {sorted(found.achieved[goal])}, listed for {is_listed}")
    differences += [f"{goal}: listed, and not tried" for goal in wanted.keys() - GOALS.keys()]
    return differences


def main() -> None:
    """Run it and print what was found."""
    parser = argparse.ArgumentParser(description="a forger on open, pinned and signed vehicle links")
    parser.add_argument("--speed", type=float, default=3.0)
    parser.add_argument("--rounds", type=int, default=1)
    given, failures = parser.parse_args(), list[str]()
    for _ in range(given.rounds):
        began_s, found = time.monotonic(), Found()
        with tempfile.TemporaryDirectory(prefix="waydrop-forge-") as folder:
            asyncio.run(campaign(Path(folder), given.speed, found))
        failures += verdict(found) + found.failures
        print(
            f"{found.sent} forged frames, {found.commands} commands under a flood, {time.monotonic() - began_s:.0f} s: "
            f"{len(failures)} failures"
        )
    print("\n".join(failures))
    sys.exit(bool(failures))


if __name__ == "__main__":
    main()
