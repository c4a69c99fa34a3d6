"""Every plan in plans/ is flown: its drops end as they should, and its items come in the predicted order.

So is a QGroundControl .plan made by hand: it is converted, flown, and exported equal in meaning.
"""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import aiohttp

from app.domain.reasons import ReasonCode
from tests.support.forked_service import ForkedService
from tests.support.interchange_files import document, meaning
from tests.support.paths import PLANS
from tests.support.patient_drops import patient
from tests.support.service_process import Dispatcher
from tests.support.simulated import SimulatedFleet

PLANS = sorted((PLANS).glob("*.json"))
PLAN_FILE = "multicopter-delivery.plan"
AIRFRAME = {"multicopter": "quad", "fixed_wing": "plane", "vtol": "vtol", "rover": "rover", "airship": "airship"}
SUPERVISED_SPEED = 4.0
LONGEST_FLIGHT_S = 300.0
FOUND_S = 180.0
OTHERS = {
    code.value
    for code in (
        ReasonCode.RETURN_BY_OTHERS,
        ReasonCode.TAKEN_BY_OTHERS,
        ReasonCode.NOT_IN_MISSION,
        ReasonCode.FAILSAFE,
        ReasonCode.FAILSAFE_MODE,
        ReasonCode.VEHICLE_LANDS,
        ReasonCode.LAND_BY_OTHERS,
    )
}


async def test_every_plan_flies_as_predicted(tmp_path: Path, http: aiohttp.ClientSession) -> None:
    """All at once, one vehicle each: at the highest speed factor at which our own timers still hold."""
    plans = [patient(json.loads(path.read_text())) for path in PLANS]
    assert plans, "there must be example plans"
    fleet = ",".join(AIRFRAME[plan["vehicle_type"]] + ":winch=1" * _has_winch(plan) for plan in plans) + ",quad"
    with (
        SimulatedFleet(fleet, speed=SUPERVISED_SPEED) as simulated,
        ForkedService(tmp_path, simulated.connections) as service,
    ):
        dispatcher = Dispatcher(http, service.url)
        await dispatcher.until_vehicles(len(plans) + 1, FOUND_S)
        plans.append(await _converted(dispatcher))
        flights = [_fly(dispatcher, plan, f"v{number}") for number, plan in enumerate(plans, start=1)]
        ended = await asyncio.gather(*flights)
        log = service.log()
    names = [*(path.name for path in PLANS), PLAN_FILE]
    wrong = [f"{name}: {problem}" for name, problem in zip(names, ended, strict=True) if problem]
    assert not wrong, "\n".join([*wrong, log])


async def _converted(dispatcher: Dispatcher) -> Any:
    """The hand-made file as a plan, which is exported with the same items, fence and rally points."""
    plan = (await dispatcher.post("/plan-conversions", document(PLAN_FILE)))["plan"]
    stored = await dispatcher.post("/plans", plan)
    assert meaning(await dispatcher.get(f"/plans/{stored['id']}/exports/qgc")) == meaning(document(PLAN_FILE))
    return plan


async def _fly(dispatcher: Dispatcher, plan: Any, vehicle_id: str) -> str:
    """What went otherwise than promised; empty if nothing."""
    made = await dispatcher.post("/plans", plan)
    run = await dispatcher.post("/runs", {"plan": made["id"], "vehicle": vehicle_id, "start": True})
    try:
        run = await dispatcher.until_over(run["id"], LONGEST_FLIGHT_S)
    except AssertionError as error:
        return str(error)
    if run["state"] != "completed":
        return f"it ended {run['state']}: {run['reason']}; flown {run['flown_item_ids']}; drops {run['drops']}"
    wrong = [drop for drop in run["drops"] if drop["outcome"] != _expected_outcome(plan, drop)]
    if wrong:
        return f"drops ended otherwise than expected: {wrong}"
    if run["flown_item_ids"] != made["timeline"]["order"]:
        return f"predicted {made['timeline']['order']}, flown {run['flown_item_ids']}"
    blamed = await _blamed(dispatcher, run["id"])
    if blamed:
        return f"nobody but the plan moved it, and others are named: {blamed}"
    return _not_compared(await dispatcher.get(f"/runs/{run['id']}/comparison"), made["timeline"]["order"])


async def _blamed(dispatcher: Dispatcher, run_id: str) -> list[str]:
    """Reasons by which somebody else, or a failsafe, had the vehicle: in an undisturbed flight there are none."""
    page = await dispatcher.get(f"/runs/{run_id}/events?limit=500")
    reasons = [event["data"]["reason"] for event in page["events"] if event["kind"] == "run.changed"]
    return [reason["code"] for reason in reasons if reason is not None and reason["code"] in OTHERS]


def _not_compared(comparison: Any, order: list[str]) -> str:
    """What has no place in the comparison, or neither a flown time nor a reason. How far apart they are: see bench."""
    if [item["item_id"] for item in comparison["items"]] != order:
        return f"not every item is compared: {comparison['items']}"
    empty = [part for part in comparison["items"] if part["flown_s"] is None and not part["reason"]]
    empty += [part for part in comparison["drops"] if part["distance_m"] is None and not part["reason"]]
    return f"neither compared nor explained: {empty}" if empty else ""


def _expected_outcome(plan: Any, drop: Any) -> str:
    """An embedded winch drop leaves no sign on the link: the payload acks to the autopilot alone, so it is unknown."""
    item = next(item for item in plan["items"] if item["id"] == drop["plan_item_id"])
    return "unknown" if item["type"] == "winch" and not drop["supervised"] else "released"


def _has_winch(plan: Any) -> bool:
    return any(item["type"] == "winch" for item in plan["items"])
