"""Idempotency-Key of commands: a late repetition moves no vehicle, and a key holds back nothing that is urgent."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.api import ApiServices
from app.api.routing import API
from app.domain.errors import StorageError
from app.domain.ports.stores import AnswerStore, StoredAnswer
from app.domain.vehicle.state import FlightMode
from tests.support.asking_drop import asked, flying_to_consent
from tests.support.fakes import MemoryClaims
from tests.support.runs_api import create, plan_id, reaches
from tests.support.service_in_process import Service, run_service

__all__ = ["plan_id"]

KEY = {"Idempotency-Key": "resume-2041"}

WITHOUT_KEY = {
    f"{API}/job-checks": "a check",
    f"{API}/plan-checks": "a check",
    f"{API}/plan-conversions": "a check",
    f"{API}/targets/{{feed}}": "a measurement, one a second",
    f"{API}/vehicles/{{vehicle_id}}/tasks/{{task_id}}/target": "a measurement",
    f"{API}/vehicles/{{vehicle_id}}/offboard/setpoint": "a measurement, many a second",
    f"{API}/vehicles/{{vehicle_id}}/offboard/lease/renew": "a renewal",
    f"{API}/vehicles/{{vehicle_id}}/offboard/lease": "the answer is a secret",
    f"{API}/webhooks": "the answer has a secret",
}


async def test_every_post_honours_a_key_except_for_a_reason(service: Service) -> None:
    _, _, document = await service.call("GET", f"{API}/openapi.json")
    posts = {path: item["post"] for path, item in document["paths"].items() if "post" in item}
    keyed = {path for path, post in posts.items() if _takes_key(post)}
    assert set(posts) - keyed == set(WITHOUT_KEY)


def _takes_key(operation: dict[str, Any]) -> bool:
    return any(parameter["name"] == "Idempotency-Key" for parameter in operation.get("parameters", ()))


async def test_a_late_repetition_of_a_resume_leaves_the_vehicle_where_the_operator_paused_it(
    service: Service, plan_id: str
) -> None:
    path = f"{API}/runs/{(await create(service, plan_id, start=True))['id']}"
    await reaches(service, path.rpartition("/")[2], "flying")
    await _command(service, f"{path}/pause", "paused")
    first = await _command(service, f"{path}/resume", "flying", KEY)
    await _command(service, f"{path}/pause", "paused")
    status, headers, again = await service.call("POST", f"{path}/resume", headers=KEY)
    assert (status, headers["Idempotency-Replayed"], again) == (202, "true", first)
    assert service.links[0].state().mode is FlightMode.HOLD
    assert (await service.call("GET", path))[2]["state"] == "paused"


async def _command(service: Service, path: str, state: str, headers: dict[str, str] | None = None) -> Any:
    status, _, run = await service.call("POST", path, headers=headers)
    assert status == 202
    await reaches(service, run["id"], state)
    return run


class UnreadableAnswers:
    """AnswerStore on a disk that fails."""

    async def get(self, key: str) -> StoredAnswer | None:
        raise StorageError("the disk cannot be read")

    async def put(self, answer: StoredAnswer, *, replaces: bool = False) -> None:
        raise StorageError("no space left on the disk")

    async def forget(self, key: str) -> None:
        """Nothing to forget."""


class HangingAnswers:
    """AnswerStore on a disk that does not answer."""

    async def get(self, key: str) -> StoredAnswer | None:
        await asyncio.Event().wait()
        return None

    async def put(self, answer: StoredAnswer, *, replaces: bool = False) -> None:
        await asyncio.Event().wait()

    async def forget(self, key: str) -> None:
        """Nothing to forget."""


class TakenClaims:
    """ClaimStore of a cluster where another node began with each key and has not ended."""

    async def claim(self, key: str) -> bool:
        return False

    async def release(self, key: str) -> None:
        """Nothing to release."""


def _with_answers(answers: AnswerStore) -> Callable[[ApiServices], ApiServices]:
    return lambda services: replace(services, answers=answers)


def _with_taken_claims(services: ApiServices) -> ApiServices:
    return replace(services, claims=TakenClaims())


@pytest.mark.parametrize(
    "change",
    [_with_answers(UnreadableAnswers()), _with_answers(HangingAnswers()), _with_taken_claims],
    ids=["the disk fails", "the disk hangs", "another node has the key"],
)
async def test_a_key_does_not_hold_back_a_pause(
    tmp_path: Path, plan: dict[str, Any], change: Callable[[ApiServices], ApiServices]
) -> None:
    async with run_service(tmp_path, change=change) as service:
        _, _, made = await service.call("POST", f"{API}/plans", json=plan)
        run = await create(service, made["id"], start=True)
        await reaches(service, run["id"], "flying")
        async with asyncio.timeout(10.0):
            await _command(service, f"{API}/runs/{run['id']}/pause", "paused", KEY)
        assert service.links[0].state().mode is FlightMode.HOLD


@pytest.mark.parametrize(
    "change",
    [_with_answers(UnreadableAnswers()), _with_answers(HangingAnswers()), _with_taken_claims],
    ids=["the disk fails", "the disk hangs", "another node has the key"],
)
async def test_a_key_does_not_hold_back_a_consent(
    tmp_path: Path, plan: dict[str, Any], change: Callable[[ApiServices], ApiServices]
) -> None:
    async with run_service(tmp_path, change=change) as service:
        flown = await flying_to_consent(service, plan)
        question = await asked(service, plan, flown)
        said = {"grant": True, "question": question["question"]}
        async with asyncio.timeout(10.0):
            for _ in range(2):
                status, _, run = await service.call(
                    "POST", f"{API}/runs/{flown}/drops/drop/consent", json=said, headers=KEY
                )
                assert (status, run["drops"][0]["consent"]["state"]) == (200, "granted")


class HangingClaims(MemoryClaims):
    """ClaimStore whose server stops answering once a key is claimed."""

    async def release(self, key: str) -> None:
        await asyncio.Event().wait()


async def test_a_key_does_not_hold_back_the_refusal_of_a_pause(tmp_path: Path) -> None:
    async with run_service(tmp_path, change=lambda services: replace(services, claims=HangingClaims())) as service:
        async with asyncio.timeout(10.0):
            for _ in range(2):
                status, _, problem = await service.call("POST", f"{API}/runs/none/pause", headers=KEY)
                assert (status, problem["code"]) == (404, "resource.not_found")


async def test_a_refused_pause_releases_its_own_claim_and_no_other(tmp_path: Path) -> None:
    claims = MemoryClaims()
    async with run_service(tmp_path, change=lambda services: replace(services, claims=claims)) as service:
        await service.call("POST", f"{API}/runs/none/pause", headers=KEY)
        assert claims.released == claims.claimed
        assert len(claims.claimed) == 1
        claims.keys.update(claims.claimed)  # another node begins with it
        await service.call("POST", f"{API}/runs/none/pause", headers=KEY)
        assert claims.keys == set(claims.claimed)
