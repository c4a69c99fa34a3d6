"""Whatever goes wrong at a drop, it ends in a known outcome that its evidence bears: one flight for each branch."""

from __future__ import annotations

import asyncio
from pathlib import Path

import aiohttp

from app.storage import verify_journal
from tests.e2e.drop_cases import ALTERNATE, CASES, SPEED, Branch, Case
from tests.support.forked_service import ForkedService
from tests.support.service_process import Dispatcher
from tests.support.simulated import SimulatedFleet

PARAMS = "COM_LOW_BAT_ACT=3,RTL_RETURN_ALT=12.0"
"""A low battery sends it home, and each goes home no higher than it flies: the way back is no part of the promise."""
FOUND_S = 180.0


async def fly(case: Case, branch: Branch) -> str:
    """What went otherwise than it must; empty if nothing."""
    try:
        await case.before(branch)
        alternate = ALTERNATE if case.has_alternate else {}
        drop = {"hold_s": case.hold_s, **case.asks, **alternate}
        await branch.start(drop, case.on_failure, waits_first=case.waits_first)
        await case.flight(branch)
        run = await branch.end()
    except AssertionError as error:
        return f"{case.name}: {error}"
    drop, elsewhere = run["drops"][0], [(there["outcome"], there["certainty"]) for there in run["drops"][1:]]
    seen = (run["state"], drop["outcome"], drop["certainty"], drop["attempts"], drop["acknowledged_at"] is not None)
    right = (
        run["state"] in case.states
        and (drop["outcome"], drop["certainty"]) in case.outcomes
        and drop["attempts"] in case.attempts
        and case.is_acknowledged in (None, drop["acknowledged_at"] is not None)
        and (drop["commanded_at"] is not None) == (drop["attempts"] > 0)
        and drop["reason"] is not None
        and (drop["consent"] or {}).get("state") == case.consent
        and elsewhere == ([case.at_alternate] if case.at_alternate else [])
        and ("locker" in run["flown_item_ids"]) == (case.at_alternate is not None)
    )
    return "" if right else f"{case.name}: it ended as {seen}, {elsewhere}: {run['reason']}; {drop}"


async def fly_all(first: Case, branch: Branch) -> list[str]:
    """One vehicle's cases, one after the other."""
    return [await fly(case, branch) for case in (first, *(case for case in CASES if case.after == first.name))]


async def test_every_way_a_drop_can_fail_ends_in_its_outcome_with_evidence(
    tmp_path: Path, http: aiohttp.ClientSession
) -> None:
    first = [case for case in CASES if not case.after]
    with (
        SimulatedFleet(",".join(["quad"] * len(first)), speed=SPEED, params=PARAMS) as fleet,
        ForkedService(tmp_path, fleet.connections) as service,
    ):
        dispatcher = Dispatcher(http, service.url)
        await dispatcher.until_vehicles(len(first), FOUND_S)
        flights = [fly_all(case, Branch(number, fleet, dispatcher)) for number, case in enumerate(first, start=1)]
        wrong = [problem for problems in await asyncio.gather(*flights) for problem in problems if problem]
        log = service.log()
    assert not wrong, "\n".join([*wrong, log])
    assert (await verify_journal(tmp_path / "waydrop.db")).alterations == []
