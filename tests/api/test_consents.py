"""An operator's consent over REST: the first answer counts, and each refusal of an answer has its code."""

from __future__ import annotations

from typing import Any

from app.services.access import Role
from tests.support.asking_drop import asked, run_id, until_run
from tests.support.service_in_process import Service

__all__ = ["run_id"]


async def say(service: Service, run_id: str, body: Any, **options: Any) -> tuple[int, Any]:
    path = f"/api/v1/runs/{run_id}/drops/drop/consent"
    status, _, answer = await service.call("POST", path, json=body, **options)
    return status, answer


async def test_a_grant_counts_once_is_in_the_delivery_report_and_the_other_answer_is_409(
    service: Service, plan: dict[str, Any], run_id: str
) -> None:
    question = await asked(service, plan, run_id)
    assert question["checked"]["battery_percent"] == 90.0
    granted = {"grant": True, "question": question["question"], "comment": "gate is closed"}
    for _ in range(2):
        status, run = await say(service, run_id, granted)
        consent = run["drops"][0]["consent"]
        assert (status, consent["state"], consent["answered_by"]) == (200, "granted", "local")
    status, problem = await say(service, run_id, {"grant": False})
    assert (status, problem["code"]) == (409, "drop.consent_answered")
    await until_run(service, run_id, lambda run: run["drops"][0]["outcome"] == "released")
    _, _, report = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report")
    assert report["drops"][0]["consent"]["comment"] == "gate is closed"
    kinds = [entry["kind"] for entry in report["entries"]]
    assert kinds.index("drop.consent_asked") < kinds.index("drop.consent_closed")
    _, _, sheet = await service.call("GET", f"/api/v1/runs/{run_id}/delivery-report.html")
    assert "granted by local" in sheet
    assert "gate is closed" in sheet


async def test_a_refusal_keeps_the_parcel(service: Service, plan: dict[str, Any], run_id: str) -> None:
    await asked(service, plan, run_id)
    status, _ = await say(service, run_id, {"grant": False, "comment": "a dog"})
    assert status == 200
    run = await until_run(service, run_id, lambda run: run["drops"][0]["phase"] == "done")
    assert (run["drops"][0]["outcome"], run["drops"][0]["commanded_at"]) == ("kept", None)


async def test_what_is_not_asked_cannot_be_answered(service: Service, plan: dict[str, Any], run_id: str) -> None:
    status, problem = await say(service, run_id, {"grant": True, "question": 1})
    assert (status, problem["code"]) == (409, "drop.consent_not_asked")
    await asked(service, plan, run_id)
    status, problem = await say(service, run_id, {"grant": True, "question": 2})
    assert (status, problem["code"], problem["question"]) == (409, "drop.consent_not_asked", 1)
    granted = {"grant": True, "question": 1}
    status, _, problem = await service.call("POST", f"/api/v1/runs/{run_id}/drops/no/consent", json=granted)
    assert (status, problem["code"]) == (404, "resource.not_found")
    status, _, problem = await service.call("POST", "/api/v1/runs/no/drops/drop/consent", json=granted)
    assert (status, problem["code"]) == (404, "resource.not_found")


async def test_an_answer_that_says_neither_yes_nor_no_is_none(service: Service) -> None:
    for body in ({}, {"grant": 1}, {"grant": None}, {"grant": True, "question": 0}, {"yes": True}):
        status, problem = await say(service, "no", body)
        assert (status, problem["code"]) == (422, "request.invalid"), body


async def test_a_grant_without_the_number_of_the_question_that_was_seen_is_invalid_and_counts_for_none(
    service: Service, plan: dict[str, Any], run_id: str
) -> None:
    await asked(service, plan, run_id)
    for body in ({"grant": True}, {"grant": True, "question": None}):
        status, problem = await say(service, run_id, body)
        assert (status, problem["code"]) == (422, "request.invalid")
    _, _, run = await service.call("GET", f"/api/v1/runs/{run_id}")
    assert run["drops"][0]["consent"]["state"] == "asked"


async def test_a_dispatch_system_cannot_consent_and_the_record_names_the_pilot_who_did(
    service: Service, plan: dict[str, Any], run_id: str
) -> None:
    await asked(service, plan, run_id)
    dispatcher, pilot = await service.token(Role.DISPATCHER), await service.token(Role.PILOT)
    status, problem = await say(service, run_id, {"grant": True, "question": 1}, headers=dispatcher)
    assert (status, problem["code"]) == (403, "role.insufficient")
    status, run = await say(service, run_id, {"grant": True, "question": 1}, headers=pilot)
    assert (status, run["drops"][0]["consent"]["answered_by"]) == (200, "a pilot")
