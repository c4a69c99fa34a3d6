"""Whatever goes wrong at a drop, it ends in a known outcome that its evidence bears: one vehicle for each branch."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import aiohttp

from app.storage import verify_journal
from tests.service import Dispatcher, ServiceProcess
from tests.simulated import SimulatedFleet
from tests.unit.domain.plan_pieces import RETURN, gripper, plan_json, takeoff, waypoint

SPEED = 4.0
FLIGHT_S = 120.0
LONG_HOLD_S, SHORT_HOLD_S, ASKING_HOLD_S = 40.0, 12.0, 160.0
"""Of vehicle time: the long one leaves a busy machine ten seconds to look and to command, the longest one also some for
an answer.
"""


class Branch:
    """One vehicle's flight: its faults, and waiting for what its drop does."""

    def __init__(self, number: int, fleet: SimulatedFleet, desk: Dispatcher) -> None:
        self._number = number
        self._fleet = fleet
        self._desk = desk
        self.run_id = ""

    async def fault(self, name: str, value: object) -> None:
        await asyncio.to_thread(self._fleet.control, name, value, system_id=self._number)

    async def phase(self, *phases: str) -> None:
        """Until the drop is in one of these phases."""
        promise = f"the drop of v{self._number} must be {phases}"
        await self._desk.until_run(self.run_id, lambda run: run["drops"][0]["phase"] in phases, promise, FLIGHT_S)

    async def on_the_way(self) -> None:
        """Until it flies to the drop."""
        promise = f"v{self._number} must fly to its drop"
        await self._desk.until_run(self.run_id, lambda run: run["item_id"] == "item-2", promise, FLIGHT_S)

    async def tell(self, action: str) -> None:
        await self._desk.post(f"/runs/{self.run_id}/{action}")

    async def answer(self, *, grant: bool) -> None:
        """Until an operator is asked; then the answer."""
        await self.phase("asking")
        await self._desk.post(f"/runs/{self.run_id}/drops/item-3/consent", {"grant": grant, "question": 1})

    async def start(self, drop: dict[str, Any], on_failure: str) -> None:
        items = takeoff(12), waypoint(30, 0, 12), gripper(**drop), RETURN
        plan = plan_json("multicopter", *items, contingency={"on_drop_failure": on_failure})
        self.run_id = await self._desk.fly(plan, f"v{self._number}")

    async def end(self) -> Any:
        return await self._desk.until_over(self.run_id, FLIGHT_S)


@dataclass(frozen=True, slots=True)
class Case:
    """What is done before the start and in flight, and how run and drop must end: any of the named ways."""

    name: str
    before: Callable[[Branch], Awaitable[None]]
    flight: Callable[[Branch], Awaitable[None]]
    states: tuple[str, ...]
    outcomes: tuple[tuple[str, str], ...]
    attempts: range
    is_acknowledged: bool | None
    hold_s: float = LONG_HOLD_S
    asks: dict[str, Any] = field(default_factory=dict)
    on_failure: str = "continue"
    consent: str | None = None


async def nothing(_: Branch) -> None:
    """All goes well."""


async def stuck(branch: Branch) -> None:
    await branch.fault("stuck_gripper", True)


async def slow(branch: Branch) -> None:
    await branch.fault("slow_gripper", 3.0)


async def lost_ack(branch: Branch) -> None:
    await branch.phase("holding")
    await branch.fault("lost_ack", 2)


async def refused_upload(branch: Branch) -> None:
    await branch.fault("refuse_upload", 4)


async def cut_on_the_way(branch: Branch) -> None:
    await branch.on_the_way()
    await branch.fault("link_cut", True)
    await asyncio.sleep(40.0 / SPEED)  # the hold passes unseen: this is the time that the link is away
    await branch.fault("link_cut", False)


async def cut_while_releasing(branch: Branch) -> None:
    await branch.phase("releasing")
    await branch.fault("link_cut", True)
    await asyncio.sleep(24.0 / SPEED)
    await branch.fault("link_cut", False)


async def cut_after(branch: Branch) -> None:
    await branch.phase("done")
    await branch.fault("link_cut", True)
    await asyncio.sleep(24.0 / SPEED)
    await branch.fault("link_cut", False)


async def reboot(branch: Branch) -> None:
    await branch.on_the_way()
    await branch.fault("reboot", True)


async def pilot_takes_over(branch: Branch) -> None:
    await branch.on_the_way()
    await branch.fault("mode", "RTL")


async def low_battery(branch: Branch) -> None:
    await branch.on_the_way()
    await branch.fault("battery_percent", 6.0)


async def operator_consents(branch: Branch) -> None:
    await branch.answer(grant=True)


async def operator_refuses(branch: Branch) -> None:
    await branch.answer(grant=False)


async def operator_returns(branch: Branch) -> None:
    await branch.on_the_way()
    await branch.tell("return")


RELEASED = ("released", "acknowledged")
SEEN = ("released", "inferred")
KEPT = ("kept", "inferred")
ASKS: dict[str, Any] = {"consent": "operator"}
CASES = (
    Case("all is well", nothing, nothing, ("completed",), (RELEASED,), range(1, 2), True),
    Case("stuck", stuck, nothing, ("completed",), (RELEASED,), range(1, 2), True),
    Case("slow", slow, nothing, ("completed",), (RELEASED,), range(1, 2), True),
    Case("lost ack", nothing, lost_ack, ("completed",), (SEEN, RELEASED), range(1, 4), None),
    Case("refused upload", refused_upload, nothing, ("failed",), (KEPT,), range(1), False),
    Case("link cut on the way", nothing, cut_on_the_way, ("completed",), (KEPT,), range(1), False, hold_s=SHORT_HOLD_S),
    Case(
        "link cut while releasing",
        slow,
        cut_while_releasing,
        ("completed",),
        (("unknown", "none"), SEEN),
        range(1, 2),
        False,
    ),
    Case("link cut after", nothing, cut_after, ("completed",), (RELEASED,), range(1, 2), True),
    Case("reboot", nothing, reboot, ("aborted", "failed"), (KEPT,), range(1), False),
    Case("a pilot returns", nothing, pilot_takes_over, ("failed",), (KEPT,), range(1), False),
    Case("the operator returns", nothing, operator_returns, ("aborted",), (KEPT,), range(1), False),
    Case("low battery", nothing, low_battery, ("failed",), (KEPT,), range(1), False),
    Case(
        *("an operator consents", nothing, operator_consents, ("completed",), (RELEASED,), range(1, 2), True),
        hold_s=ASKING_HOLD_S,
        asks=ASKS,
        consent="granted",
    ),
    Case(
        *("an operator says no", nothing, operator_refuses, ("aborted",), (KEPT,), range(1), False),
        hold_s=ASKING_HOLD_S,
        asks=ASKS,
        on_failure="return",
        consent="refused",
    ),
    Case(
        *("no operator answers", nothing, nothing, ("completed",), (KEPT,), range(1), False),
        hold_s=ASKING_HOLD_S,
        asks={**ASKS, "consent_timeout_s": 5},
        consent="timed_out",
    ),
)


async def fly(case: Case, branch: Branch) -> str:
    """What went otherwise than it must; empty if nothing."""
    try:
        await case.before(branch)
        await branch.start({"hold_s": case.hold_s, **case.asks}, case.on_failure)
        await case.flight(branch)
        run = await branch.end()
    except AssertionError as error:
        return f"{case.name}: {error}"
    drop = run["drops"][0]
    seen = (run["state"], drop["outcome"], drop["certainty"], drop["attempts"], drop["acknowledged_at"] is not None)
    right = (
        run["state"] in case.states
        and (drop["outcome"], drop["certainty"]) in case.outcomes
        and drop["attempts"] in case.attempts
        and case.is_acknowledged in (None, drop["acknowledged_at"] is not None)
        and (drop["commanded_at"] is not None) == (drop["attempts"] > 0)
        and drop["reason"] != ""
        and (drop["consent"] or {}).get("state") == case.consent
    )
    return "" if right else f"{case.name}: it ended as {seen}: {run['reason']}; {drop}"


async def test_every_way_a_drop_can_fail_ends_in_its_outcome_with_evidence(
    tmp_path: Path, http: aiohttp.ClientSession
) -> None:
    with (
        SimulatedFleet(",".join(["quad"] * len(CASES)), speed=SPEED, params="COM_LOW_BAT_ACT=3") as fleet,
        ServiceProcess(tmp_path, fleet.connections) as service,
    ):
        desk = Dispatcher(http, service.url)
        await desk.until_vehicles(len(CASES))
        flights = [fly(case, Branch(number, fleet, desk)) for number, case in enumerate(CASES, start=1)]
        wrong = [problem for problem in await asyncio.gather(*flights) if problem]
        log = service.log()
    assert not wrong, "\n".join([*wrong, log])
    assert (await verify_journal(tmp_path / "waydrop.db")).alterations == []
