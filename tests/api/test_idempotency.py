"""Idempotency-Key: done once, answered as often as asked."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.api import ApiServices
from app.domain.cluster.errors import GatewayUnreachableError, NoReplyError
from app.domain.errors import StorageError, WaydropError
from app.domain.plan import Plan
from app.domain.ports.stores import AnswerTo, ClaimStore
from app.services.access import Role
from app.services.plans import Plans, PlanView
from tests.api.broken_parts import without_answers
from tests.support.fakes import MemoryClaims
from tests.support.service_in_process import Service, run_service

KEY = {"Idempotency-Key": "0b8f6c1e-order-2041"}


async def plans_stored(service: Service) -> int:
    """How many plans there are."""
    _, _, listed = await service.call("GET", "/api/v1/plans?limit=500")
    return len(listed["plans"])


async def created(service: Service, path: str) -> int:
    """How many plans, runs or jobs there are."""
    _, _, listed = await service.call("GET", f"{path}?limit=500")
    return len(listed[path.rpartition("/")[2]])


async def test_a_repetition_gets_the_first_answer_and_nothing_is_done_twice(
    service: Service, plan: dict[str, Any]
) -> None:
    first = await service.call("POST", "/api/v1/plans", json=plan, headers=KEY)
    again = await service.call("POST", "/api/v1/plans", json=plan, headers=KEY)
    assert first[0] == again[0] == 201
    assert first[2] == again[2]
    for name in ("Location", "ETag", "Content-Type"):
        assert first[1][name] == again[1][name]
    assert "Idempotency-Replayed" not in first[1]
    assert again[1]["Idempotency-Replayed"] == "true"
    assert await plans_stored(service) == 1


async def test_many_at_once_are_done_once(service: Service, plan: dict[str, Any]) -> None:
    answers = await asyncio.gather(*(service.call("POST", "/api/v1/plans", json=plan, headers=KEY) for _ in range(20)))
    assert {answer[0] for answer in answers} == {201}
    assert len({answer[2]["id"] for answer in answers}) == 1
    assert sum("Idempotency-Replayed" in answer[1] for answer in answers) == 19
    assert await plans_stored(service) == 1


async def test_many_runs_at_once_with_one_key_are_one_run_and_no_conflict(
    service: Service, plan: dict[str, Any]
) -> None:
    _, _, made = await service.call("POST", "/api/v1/plans", json=plan)
    body = {"plan": made["id"], "vehicle": service.v1}
    answers = await asyncio.gather(*(service.call("POST", "/api/v1/runs", json=body, headers=KEY) for _ in range(10)))
    assert {answer[0] for answer in answers} == {202}
    assert len({answer[2]["id"] for answer in answers}) == 1


async def test_the_same_key_with_another_body_is_refused(service: Service, plan: dict[str, Any]) -> None:
    await service.call("POST", "/api/v1/plans", json=plan, headers=KEY)
    status, _, problem = await service.call("POST", "/api/v1/plans", json={**plan, "name": "Other"}, headers=KEY)
    assert (status, problem["code"]) == (422, "idempotency.key_reused")
    assert await plans_stored(service) == 1


async def test_a_refusal_is_not_kept_for_nothing_was_done(service: Service, plan: dict[str, Any]) -> None:
    _, _, made = await service.call("POST", "/api/v1/plans", json=plan)
    body = {"plan": made["id"], "vehicle": service.v1}
    _, _, blocking = await service.call("POST", "/api/v1/runs", json=body)
    status, _, problem = await service.call("POST", "/api/v1/runs", json=body, headers=KEY)
    assert (status, problem["code"]) == (409, "vehicle.busy")
    await service.call("POST", f"/api/v1/runs/{blocking['id']}/abort")
    async with asyncio.timeout(20):
        while (await service.call("POST", "/api/v1/runs", json=body, headers=KEY))[0] != 202:
            await asyncio.sleep(0.01)


async def test_without_a_key_each_request_is_its_own(service: Service, plan: dict[str, Any]) -> None:
    for _ in range(2):
        await service.call("POST", "/api/v1/plans", json=plan)
    assert await plans_stored(service) == 2


async def test_an_answer_outlives_a_restart(tmp_path: Path, plan: dict[str, Any]) -> None:
    async with run_service(tmp_path) as service:
        _, _, first = await service.call("POST", "/api/v1/plans", json=plan, headers=KEY)
    async with run_service(tmp_path) as service:
        _, headers, again = await service.call("POST", "/api/v1/plans", json=plan, headers=KEY)
    assert (again, headers["Idempotency-Replayed"]) == (first, "true")


async def test_what_was_done_is_said_even_if_the_answer_cannot_be_kept(tmp_path: Path, plan: dict[str, Any]) -> None:
    """Else the client would do it again at once. The answer that was stored with the plan is there for a repetition."""
    async with run_service(tmp_path, change=without_answers) as service:
        status, _, _ = await service.call("POST", "/api/v1/plans", json=plan, headers=KEY)
        assert status == 201
    async with run_service(tmp_path) as service:
        status, headers, _ = await service.call("POST", "/api/v1/plans", json=plan, headers=KEY)
        assert (status, headers["Idempotency-Replayed"]) == (201, "true")
        assert await plans_stored(service) == 1


@pytest.mark.parametrize(
    ("path", "other"),
    [("/api/v1/plans", {"name": "Other"}), ("/api/v1/runs", {"start": True}), ("/api/v1/jobs", {"priority": 1})],
)
async def test_what_was_created_before_a_kill_is_not_created_again(
    tmp_path: Path, plan: dict[str, Any], path: str, other: dict[str, Any]
) -> None:
    """Killed when it is stored, before the answer was kept and sent."""
    async with run_service(tmp_path, change=without_answers) as service:
        _, _, made = await service.call("POST", "/api/v1/plans", json=plan)
        flown = {"plan": made["id"], "vehicle": service.v1}
        body = plan if path.endswith("plans") else flown
        status, _, first = await service.call("POST", path, json=body, headers=KEY)
        assert status in (201, 202)
        if path.endswith("runs"):  # so that its vehicle is free for another one
            await service.call("POST", f"{path}/{first['id']}/abort")
    async with run_service(tmp_path) as service:
        before = await created(service, path)
        _, headers, again = await service.call("POST", path, json=body, headers=KEY)
        assert (again["id"], headers.get("Idempotency-Replayed")) == (first["id"], "true")
        assert headers["Location"] == f"{path}/{first['id']}"
        status, _, problem = await service.call("POST", path, json={**body, **other}, headers=KEY)
        assert (status, problem["code"]) == (422, "idempotency.key_reused")
        assert await created(service, path) == before


async def test_a_job_is_answered_before_its_silent_vehicle(tmp_path: Path, plan: dict[str, Any]) -> None:
    async with run_service(tmp_path) as service:
        service.links[0].facts_gate.clear()
        _, _, made = await service.call("POST", "/api/v1/plans", json=plan)
        body = {"plan": made["id"], "vehicle": service.v1}
        began_s = asyncio.get_running_loop().time()
        status, _, job = await service.call("POST", "/api/v1/jobs", json=body, headers=KEY)
        assert (status, job["candidates"][0]["refusals"][0]["code"]) == (202, "vehicle.silent")
        assert asyncio.get_running_loop().time() - began_s < 2.0
        _, _, again = await service.call("POST", "/api/v1/jobs", json=body, headers=KEY)
        assert again == job


async def test_one_clients_key_is_not_anothers(service: Service, plan: dict[str, Any]) -> None:
    one, other = await service.token(Role.DISPATCHER), await service.token(Role.PILOT)
    _, _, first = await service.call("POST", "/api/v1/plans", json=plan, headers=KEY | one)
    _, _, second = await service.call("POST", "/api/v1/plans", json=plan, headers=KEY | other)
    assert first["id"] != second["id"]


@pytest.mark.parametrize("key", ["", "two words", "x" * 201, "\xe9"])
async def test_a_key_that_cannot_be_used_is_400(service: Service, plan: dict[str, Any], key: str) -> None:
    status, _, problem = await service.call("POST", "/api/v1/plans", json=plan, headers={"Idempotency-Key": key})
    assert (status, problem["code"]) == (400, "idempotency.key_invalid")
    assert await plans_stored(service) == 0


class FailingPlans(Plans):
    """Plans whose first creation ends with `error`. `begun` counts the creations."""

    error: WaydropError | None = None
    begun = 0

    async def create(self, plan: Plan, actor: str, answer: AnswerTo[PlanView] | None = None) -> PlanView:
        self.begun += 1
        error, self.error = self.error, None
        if error is not None:
            raise error
        return await super().create(plan, actor, answer)


def clustered(claims: ClaimStore, plans: FailingPlans) -> Callable[[ApiServices], ApiServices]:
    """A node of a cluster. It has the error of `plans`, and counts there."""

    def change(services: ApiServices) -> ApiServices:
        vars(plans).update(vars(services.plans))
        return replace(services, plans=plans, claims=claims)

    return change


def failing_plans(error: WaydropError | None = None) -> FailingPlans:
    plans = FailingPlans.__new__(FailingPlans)
    plans.error = error
    return plans


@pytest.mark.parametrize(
    ("error", "answered"),
    [
        (NoReplyError("the answer was lost"), (504, "gateway.no_reply")),
        (StorageError("it may have been stored"), (503, "storage.failed")),
    ],
)
async def test_a_request_whose_outcome_is_unknown_is_never_repeated(
    tmp_path: Path, plan: dict[str, Any], error: WaydropError, answered: tuple[int, str]
) -> None:
    plans = failing_plans(error)
    async with run_service(tmp_path, change=clustered(MemoryClaims(), plans)) as service:
        status, _, problem = await service.call("POST", "/api/v1/plans", json=plan, headers=KEY)
        assert (status, problem["code"]) == answered
        for _ in range(2):
            status, headers, problem = await service.call("POST", "/api/v1/plans", json=plan, headers=KEY)
            assert (status, problem["code"]) == (409, "idempotency.outcome_unknown")
            assert headers["Retry-After"] == "5"
            assert "a minute after" in problem["hint"], "a client can tell how long to repeat it"
            assert "new key only if that was not done" in problem["hint"], "and how it goes on then"
        assert plans.begun == 1


async def test_a_request_that_did_nothing_may_be_repeated(tmp_path: Path, plan: dict[str, Any]) -> None:
    plans = failing_plans(GatewayUnreachableError("no gateway answers"))
    async with run_service(tmp_path, change=clustered(MemoryClaims(), plans)) as service:
        status, _, problem = await service.call("POST", "/api/v1/plans", json=plan, headers=KEY)
        assert (status, problem["code"]) == (503, "gateway.unreachable")
        for _ in range(2):
            assert (await service.call("POST", "/api/v1/plans", json=plan, headers=KEY))[0] == 201
        assert plans.begun == 2
        assert await plans_stored(service) == 1


async def test_a_request_that_another_node_has_begun_is_not_begun_here(
    tmp_path_factory: pytest.TempPathFactory, plan: dict[str, Any]
) -> None:
    claims = MemoryClaims()
    begin = clustered(claims, failing_plans())
    async with run_service(tmp_path_factory.mktemp("one"), change=begin) as one:
        assert (await one.call("POST", "/api/v1/plans", json=plan, headers=KEY))[0] == 201
    other_plans = failing_plans()
    async with run_service(tmp_path_factory.mktemp("other"), change=clustered(claims, other_plans)) as other:
        status, _, problem = await other.call("POST", "/api/v1/plans", json=plan, headers=KEY)
        assert (status, problem["code"]) == (409, "idempotency.outcome_unknown")
        assert other_plans.begun == 0
