"""Changes of runs in flight over REST."""

from __future__ import annotations

import asyncio
import copy
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.api import ApiServices
from app.domain.errors import LinkTimeoutError, UploadRefusedError, VehicleRefusedError, WaydropError
from app.domain.ports.stores import AnswerTo
from app.domain.run.run import Run
from app.services.access import Role
from app.services.runs.rerouting import Rerouting
from tests.api.broken_parts import without_answers
from tests.support.asking_drop import asked
from tests.support.fakes import MemoryClaims
from tests.support.run_changes import flying
from tests.support.runs_api import reaches
from tests.support.service_in_process import LOOK_AGAIN_S, Service, run_service, until

STOP = {"id": "extra", "type": "waypoint", "latitude_deg": 47.3985, "longitude_deg": 8.5472, "relative_altitude_m": 20}


async def plan_ids(service: Service) -> list[str]:
    """Of all plans that are stored."""
    _, _, listed = await service.call("GET", "/api/v1/plans")
    return [plan["id"] for plan in listed["plans"]]


async def stored(service: Service, plan: dict[str, Any], **clinic: Any) -> str:
    """The plan with its drop at another place."""
    changed = copy.deepcopy(plan)
    changed["items"][2].update(clinic)
    _, _, made = await service.call("POST", "/api/v1/plans", json=changed)
    return str(made["id"])


async def test_a_run_flies_on_with_a_changed_plan_once_for_one_key(service: Service, plan: dict[str, Any]) -> None:
    run = await flying(service, plan)
    asked = {"plan": await stored(service, plan, latitude_deg=47.3987)}
    path, key = f"/api/v1/runs/{run['id']}/mission", {"Idempotency-Key": "change-1"}
    status, headers, changed = await service.call("POST", path, json=asked, headers=key)
    assert (status, headers["Location"]) == (202, f"/api/v1/runs/{run['id']}")
    assert (changed["plan_id"], changed["changes"], changed["state"]) == (asked["plan"], 1, "flying")
    assert (changed["change"]["continue_at"], changed["change"]["actor"]) == ("corner", "local")
    _, _, again = await service.call("POST", path, json=asked, headers=key)
    assert again["changes"] == 1
    _, _, told = await service.call("GET", f"/api/v1/runs/{run['id']}/events?limit=500")
    events = [event for event in told["events"] if event["kind"] == "run.mission_changed"]
    assert [event["data"]["change"]["plan_hash"] for event in events] == [changed["plan_hash"]]


async def test_the_delivery_report_of_a_changed_run_names_every_plan_that_was_flown(
    service: Service, plan: dict[str, Any]
) -> None:
    run = await flying(service, plan)
    asked = {"plan": await stored(service, plan, latitude_deg=47.3987)}
    await service.call("POST", f"/api/v1/runs/{run['id']}/mission", json=asked)
    _, _, report = await service.call("GET", f"/api/v1/runs/{run['id']}/delivery-report")
    assert (report["plan"]["id"], report["plan"]["is_as_flown"]) == (asked["plan"], True)
    assert [(was["id"], was["hash"]) for was in report["earlier_plans"]] == [(run["plan_id"], run["plan_hash"])]
    _, _, sheet = await service.call("GET", f"/api/v1/runs/{run['id']}/delivery-report.html")
    assert run["plan_hash"] in sheet
    _, _, comparison = await service.call("GET", f"/api/v1/runs/{run['id']}/comparison")
    assert {item["item_id"] for item in comparison["items"]} >= {"corner", "clinic", "drop", "home"}


async def test_a_run_skips_to_an_item_of_its_own_plan(service: Service, plan: dict[str, Any]) -> None:
    run = await flying(service, plan)
    path = f"/api/v1/runs/{run['id']}/mission"
    status, _, changed = await service.call("POST", path, json={"continue_at": "clinic"})
    assert (status, changed["item_id"], changed["plan_id"]) == (202, "clinic", run["plan_id"])
    status, _, problem = await service.call("POST", path, json={})
    assert (status, problem["code"]) == (422, "request.invalid")


@pytest.mark.parametrize(("where", "begins"), [({"before": "corner"}, "extra"), ({"after": "corner"}, "corner")])
async def test_a_stop_is_put_into_a_flight(
    service: Service, plan: dict[str, Any], where: dict[str, str], begins: str
) -> None:
    run = await flying(service, plan)
    path = f"/api/v1/runs/{run['id']}/inserted-items"
    status, _, changed = await service.call("POST", path, json={"items": [STOP], **where})
    assert (status, changed["change"]["continue_at"]) == (202, begins)
    assert await plan_ids(service) == [changed["plan_id"], run["plan_id"]]
    _, _, made = await service.call("GET", f"/api/v1/plans/{changed['plan_id']}")
    assert len(made["plan"]["items"]) == 6


async def test_a_stop_never_comes_between_a_drop_and_its_place(service: Service, plan: dict[str, Any]) -> None:
    run = await flying(service, plan)
    path = f"/api/v1/runs/{run['id']}/inserted-items"
    status, _, changed = await service.call("POST", path, json={"items": [STOP], "after": "clinic"})
    assert status == 202
    _, _, made = await service.call("GET", f"/api/v1/plans/{changed['plan_id']}")
    assert [item["id"] for item in made["plan"]["items"]][2:] == ["clinic", "drop", "extra", "home"]
    status, _, problem = await service.call("POST", path, json={"items": [STOP]})
    assert (status, problem["code"]) == (422, "request.invalid")
    status, _, problem = await service.call("POST", path, json={"items": [{"type": "fly"}], "after": "clinic"})
    assert (status, problem["code"]) == (422, "plan.invalid")
    assert problem["detail"].startswith("unknown type 'fly'; known values: ")
    assert problem["findings"][0]["pointer"] == "/items/0", "as the items were sent, not as they stand in the plan"


async def test_a_stop_behind_the_vehicle_is_refused(service: Service, plan: dict[str, Any]) -> None:
    run = await flying(service, plan, "clinic")
    path = f"/api/v1/runs/{run['id']}/inserted-items"
    status, _, problem = await service.call("POST", path, json={"items": [STOP], "before": "corner"})
    assert (status, problem["code"]) == (422, "plan.rejected")
    assert [finding["code"] for finding in problem["findings"]] == ["change.item_passed"]
    assert await plan_ids(service) == [run["plan_id"]], "what is refused leaves no plan behind"


async def test_a_change_that_is_under_way_or_needs_a_pause_has_its_own_code(
    service: Service, plan: dict[str, Any]
) -> None:
    embedded = copy.deepcopy(plan)
    embedded["items"][3]["mode"] = "embedded"
    run = await flying(service, embedded)
    path = f"/api/v1/runs/{run['id']}/mission"
    status, _, problem = await service.call("POST", path, json={"continue_at": "home"})
    assert (status, problem["code"]) == (409, "run.hold_required")
    await service.call("POST", f"/api/v1/runs/{run['id']}/pause")
    await reaches(service, run["id"], "paused")
    service.links[0].upload_gate.clear()
    first = asyncio.create_task(service.call("POST", path, json={"continue_at": "home"}))
    await until(lambda: service.links[0].uploads == 1)
    status, _, problem = await service.call("POST", path, json={"continue_at": "home"})
    assert (status, problem["code"]) == (409, "run.changing")
    service.links[0].upload_gate.set()
    assert (await first)[0] == 202


async def test_while_a_drop_is_in_progress_nothing_is_changed(service: Service, plan: dict[str, Any]) -> None:
    plan["items"][3]["consent"] = "operator"
    run = await flying(service, plan)
    await asked(service, plan, run["id"])
    await reaches(service, run["id"], "at_drop")
    path = f"/api/v1/runs/{run['id']}/mission"
    status, _, problem = await service.call("POST", path, json={"continue_at": "home"})
    assert (status, problem["code"]) == (409, "run.drop_in_progress")


async def test_only_a_pilot_changes_a_flight(service: Service, plan: dict[str, Any]) -> None:
    run = await flying(service, plan)
    headers = await service.token(Role.DISPATCHER)
    for path, body in (
        ("mission", {"continue_at": "clinic"}),
        ("inserted-items", {"items": [STOP], "after": "corner"}),
    ):
        status, _, problem = await service.call("POST", f"/api/v1/runs/{run['id']}/{path}", json=body, headers=headers)
        assert (status, problem["code"]) == (403, "role.insufficient")


KEY = {"Idempotency-Key": "insert-2041"}


async def insert(service: Service, run_id: str) -> tuple[int, bool, Any]:
    """The status, whether an earlier answer was replayed, and the body."""
    path = f"/api/v1/runs/{run_id}/inserted-items"
    status, headers, body = await service.call("POST", path, json={"items": [STOP], "after": "corner"}, headers=KEY)
    return status, "Idempotency-Replayed" in headers, body


async def test_items_that_were_inserted_before_a_kill_are_not_inserted_again(
    tmp_path: Path, plan: dict[str, Any]
) -> None:
    """Killed after the vehicle had them, before the answer was kept and sent."""
    async with run_service(tmp_path, change=without_answers) as service:
        run = await flying(service, plan)
        status, _, first = await insert(service, run["id"])
        assert (status, first["changes"]) == (202, 1)
    async with run_service(tmp_path) as service:
        status, replayed, again = await insert(service, run["id"])
        assert (status, replayed, again["id"]) == (202, True, run["id"])
        assert await plan_ids(service) == [first["plan_id"], run["plan_id"]]


@pytest.mark.parametrize(
    ("refusal", "answered"),
    [
        (VehicleRefusedError("the mission is infeasible"), (409, "vehicle.refused")),
        (UploadRefusedError("the vehicle refused the mission: NO_SPACE"), (502, "mission.upload_failed")),
    ],
    ids=["infeasible", "refused by MISSION_ACK"],
)
async def test_items_that_the_vehicle_refused_may_be_inserted_again(
    service: Service, plan: dict[str, Any], refusal: WaydropError, answered: tuple[int, str]
) -> None:
    run = await flying(service, plan)
    service.links[0].upload_refusal = refusal
    status, _, problem = await insert(service, run["id"])
    assert (status, problem["code"]) == answered
    service.links[0].upload_refusal = None
    async with asyncio.timeout(60):
        while (await insert(service, run["id"]))[:2] != (202, False):
            await asyncio.sleep(LOOK_AGAIN_S)


async def test_items_that_may_be_on_board_are_not_inserted_again(service: Service, plan: dict[str, Any]) -> None:
    run = await flying(service, plan)
    service.links[0].upload_refusal = LinkTimeoutError("no answer to the last item")
    status, _, problem = await insert(service, run["id"])
    assert (status, problem["code"]) == (504, "vehicle.timeout")
    service.links[0].upload_refusal = None
    status, replayed, told = await insert(service, run["id"])
    assert (status, replayed) == (202, True)
    assert told["changing"]["continue_at"] == "corner", "the run tells what came of it"


async def test_items_whose_insertion_a_pause_broke_off_on_its_way_are_not_inserted_again(
    service: Service, plan: dict[str, Any]
) -> None:
    run = await flying(service, plan)
    service.links[0].upload_gate.clear()
    first = asyncio.create_task(insert(service, run["id"]))
    await until(lambda: service.links[0].uploads == 1)
    await service.call("POST", f"/api/v1/runs/{run['id']}/pause")
    status, _, problem = await first
    assert (status, problem["code"]) == (409, "run.changing")
    service.links[0].upload_gate.set()
    status, replayed, told = await insert(service, run["id"])
    assert (status, replayed) == (202, True)
    assert told["changing"]["continue_at"] == "corner"
    assert service.links[0].uploads == 1


class ReroutingFromNode(Rerouting):
    """Changes for an API node, which stores no answer with them."""

    async def insert(
        self,
        run_id: str,
        items: Sequence[Any],
        *,
        at: str,
        after: bool,
        actor: str,
        answer: AnswerTo[Run] | None = None,
    ) -> Run:
        return await super().insert(run_id, items, at=at, after=after, actor=actor)


def as_node(services: ApiServices) -> ApiServices:
    """With the claims of a cluster."""
    rerouting = ReroutingFromNode.__new__(ReroutingFromNode)
    vars(rerouting).update(vars(services.rerouting))
    return replace(services, rerouting=rerouting, claims=MemoryClaims())


async def test_items_that_may_be_on_board_are_not_inserted_again_through_a_node(
    tmp_path: Path, plan: dict[str, Any]
) -> None:
    async with run_service(tmp_path, change=as_node) as service:
        run, link = await flying(service, plan), service.links[0]
        link.upload_refusal = UploadRefusedError("the vehicle refused the mission: NO_SPACE")
        status, _, problem = await insert(service, run["id"])
        assert (status, problem["code"]) == (502, "mission.upload_failed")
        link.upload_refusal = LinkTimeoutError("no answer to the last item")
        async with asyncio.timeout(60):
            while (await insert(service, run["id"]))[0] != 504:  # until the refused one has ended
                await asyncio.sleep(LOOK_AGAIN_S)
        link.upload_refusal = None
        status, _, problem = await insert(service, run["id"])
        assert (status, problem["code"]) == (409, "idempotency.outcome_unknown")
        assert link.uploads == 0
