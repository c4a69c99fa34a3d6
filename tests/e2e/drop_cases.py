"""What can go wrong at a drop, how it is brought about, and how run and drop must end then."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any

from tests.support.plan_pieces import RETURN, at, gripper, plan_json, takeoff, waypoint
from tests.support.service_process import Dispatcher, until
from tests.support.simulated import SimulatedFleet

SPEED = 4.0
FLIGHT_S = 240.0
LONG_HOLD_S, SHORT_HOLD_S, ASKING_HOLD_S = 40.0, 12.0, 160.0
"""Of vehicle time: the long one leaves a busy machine ten seconds to look and to command, the longest one also some for
an answer.
"""
DROP_SEQ, LOCKER_SEQ = 2, 4
"""Of a mission that waits before its drop: takeoff, the wait, the drop, a jump over its alternate, the alternate."""


class Branch:
    """One vehicle's flight: its faults, and waiting for what its drop does."""

    def __init__(self, number: int, fleet: SimulatedFleet, dispatcher: Dispatcher) -> None:
        self._number = number
        self._fleet = fleet
        self._dispatcher = dispatcher
        self.run_id = ""

    async def fault(self, name: str, value: object) -> None:
        await asyncio.to_thread(self._fleet.control, name, value, system_id=self._number)

    async def phase(self, *phases: str) -> None:
        """Until the drop is in one of these phases."""
        promise = f"the drop of v{self._number} must be {phases}"
        await self._dispatcher.until_run(self.run_id, lambda run: run["drops"][0]["phase"] in phases, promise, FLIGHT_S)

    async def on_the_way(self, item_id: str = "wait") -> None:
        """Until it flies to where it waits before the drop, or to the alternate."""
        promise = f"v{self._number} must fly to {item_id}"
        await self._dispatcher.until_run(self.run_id, lambda run: run["item_id"] == item_id, promise, FLIGHT_S)

    async def passed(self, seq: int) -> None:
        """Until the vehicle is beyond this item of its mission, or home: the simulator says so, whatever the link."""
        await until(
            lambda: asyncio.to_thread(self._fleet.truth, self._number),
            lambda vehicle: vehicle["mission_seq"] > seq or not vehicle["armed"],
            f"v{self._number} must fly beyond item {seq} of its mission",
            FLIGHT_S,
        )

    async def tell(self, action: str) -> None:
        await self._dispatcher.post(f"/runs/{self.run_id}/{action}")

    async def answer(self, *, grant: bool) -> None:
        """Until an operator is asked; then the answer."""
        await self.phase("asking")
        await self._dispatcher.post(f"/runs/{self.run_id}/drops/drop/consent", {"grant": grant, "question": 1})

    async def unanswered(self) -> None:
        """Until the time to answer is over: it does not wait for the link."""
        promise = f"the question of v{self._number} must time out"
        await self._dispatcher.until_run(
            self.run_id, lambda run: run["drops"][0]["consent"]["state"] == "timed_out", promise, FLIGHT_S
        )

    async def start(self, drop: dict[str, Any], on_failure: str, *, waits_first: bool) -> None:
        wait = [waypoint(15, 0, 12, id="wait", hold_s=LONG_HOLD_S)] if waits_first else []
        items = takeoff(12), *wait, waypoint(30, 0, 12), gripper(id="drop", **drop), RETURN
        plan = plan_json("multicopter", *items, contingency={"on_drop_failure": on_failure})
        self.run_id = await self._dispatcher.fly(plan, f"v{self._number}")

    async def end(self) -> Any:
        return await self._dispatcher.until_over(self.run_id, FLIGHT_S)


@dataclass(frozen=True, slots=True)
class Case:
    """What is done before the start and in flight, and how run and drop must end: any of the named ways.

    `waits_first`: the vehicle waits before its drop, until what must come before the release has surely been done.
    `at_alternate` is how the drop there ended; None: the vehicle never went there, whether the drop has one or not.
    `after` is the case whose vehicle flies this one when it is back: one process takes at most 15.
    """

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
    waits_first: bool = False
    has_alternate: bool = False
    at_alternate: tuple[str, str] | None = None
    after: str = ""


async def nothing(_: Branch) -> None:
    """All goes well."""


async def stuck(branch: Branch) -> None:
    await branch.fault("stuck_gripper", True)


async def slow(branch: Branch) -> None:
    await branch.fault("slow_gripper", 3.0)


async def lost_ack(branch: Branch) -> None:
    await branch.on_the_way()
    await branch.fault("lost_ack", 2)  # nothing is commanded before the release


async def refused_upload(branch: Branch) -> None:
    await branch.fault("refuse_upload", 4)


async def upload_again(branch: Branch) -> None:
    await branch.fault("refuse_upload", 0)


async def cut_on_the_way(branch: Branch) -> None:
    await branch.on_the_way()
    await branch.fault("link_cut", True)
    await branch.passed(DROP_SEQ)  # the hold passes unseen
    await branch.fault("link_cut", False)


async def cut_while_asked(branch: Branch) -> None:
    await branch.phase("asking")
    await branch.fault("link_cut", True)
    await branch.unanswered()
    await branch.fault("link_cut", False)


async def cut_while_releasing(branch: Branch) -> None:
    await branch.on_the_way()
    await branch.fault("lost_ack", 1000)  # on a busy machine the acknowledgement would come before the cut
    await branch.phase("releasing", "done")
    await branch.fault("link_cut", True)
    await asyncio.sleep(24.0 / SPEED)
    await branch.fault("link_cut", False)


async def cut_after(branch: Branch) -> None:
    await branch.phase("done")
    await branch.fault("link_cut", True)
    await asyncio.sleep(24.0 / SPEED)
    await branch.fault("link_cut", False)


async def gripper_is_gone(branch: Branch) -> None:
    await branch.on_the_way()
    await branch.fault("no_gripper", True)


async def cut_on_the_way_to_the_alternate(branch: Branch) -> None:
    await gripper_is_gone(branch)
    await branch.on_the_way("locker")
    await branch.fault("link_cut", True)
    await branch.passed(LOCKER_SEQ)  # its hold there passes unseen
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
REFUSED = ("kept", "acknowledged")
ASKS: dict[str, Any] = {"consent": "operator"}
FAR_OFF = at(30, 150, relative_altitude_m=12, id="locker", hold_s=8.0)
"""So far that there is time to cut the link on the way there."""
ALTERNATE = {"alternate": at(30, 25, relative_altitude_m=12, id="locker", hold_s=LONG_HOLD_S)}
CASES = (
    Case("all is well", nothing, nothing, ("completed",), (RELEASED,), range(1, 2), True),
    Case("stuck", stuck, nothing, ("completed",), (RELEASED,), range(1, 2), True, has_alternate=True),
    Case("slow", slow, nothing, ("completed",), (RELEASED,), range(1, 2), True),
    Case("lost ack", nothing, lost_ack, ("completed",), (SEEN, RELEASED), range(1, 4), None, waits_first=True),
    Case("refused upload", refused_upload, nothing, ("failed",), (KEPT,), range(1), False),
    Case(
        *("link cut on the way", nothing, cut_on_the_way, ("completed",), (KEPT,), range(1), False),
        hold_s=SHORT_HOLD_S,
        waits_first=True,
        has_alternate=True,
    ),
    Case(
        "link cut while releasing",
        slow,
        cut_while_releasing,
        ("completed",),
        (("unknown", "none"), SEEN),
        range(1, 4),
        False,
        waits_first=True,
        has_alternate=True,
    ),
    Case("link cut after", nothing, cut_after, ("completed",), (RELEASED,), range(1, 2), True),
    Case(
        *("reboot", nothing, reboot, ("aborted", "failed"), (KEPT,), range(1), False),
        waits_first=True,
        has_alternate=True,
    ),
    Case(
        *("a pilot returns", nothing, pilot_takes_over, ("failed",), (KEPT,), range(1), False),
        waits_first=True,
        has_alternate=True,
    ),
    Case(
        *("the operator returns", nothing, operator_returns, ("aborted",), (KEPT,), range(1), False),
        waits_first=True,
        has_alternate=True,
    ),
    Case(
        *("low battery", nothing, low_battery, ("failed",), (KEPT,), range(1), False),
        waits_first=True,
        has_alternate=True,
    ),
    Case(
        *("the vehicle refuses", nothing, gripper_is_gone, ("aborted",), (KEPT, REFUSED), range(1, 2), True),
        on_failure="return",
        waits_first=True,
        after="all is well",
    ),
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
        *("link cut on the way to the alternate", nothing, cut_on_the_way_to_the_alternate),
        *(("completed",), (KEPT, REFUSED), range(1, 2), True),
        asks={"alternate": FAR_OFF},
        waits_first=True,
        at_alternate=KEPT,
        after="a pilot returns",
    ),
    Case(
        *("no operator answers", nothing, nothing, ("completed",), (KEPT,), range(1), False),
        hold_s=ASKING_HOLD_S,
        asks={**ASKS, "consent_timeout_s": 5},
        consent="timed_out",
    ),
    Case(
        *("link cut while asked", upload_again, cut_while_asked, ("completed",), (KEPT,), range(1), False),
        hold_s=ASKING_HOLD_S,
        asks={**ASKS, "consent_timeout_s": 15},  # to be seen in that time
        consent="timed_out",
        after="refused upload",
    ),
    Case(
        *("no, but at the alternate", nothing, operator_refuses, ("completed",), (KEPT,), range(1), False),
        hold_s=ASKING_HOLD_S,
        asks=ASKS,
        on_failure="return",
        consent="refused",
        has_alternate=True,
        at_alternate=RELEASED,
        after="the operator returns",
    ),
)
