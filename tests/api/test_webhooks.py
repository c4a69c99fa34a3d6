"""Webhooks over REST: made, changed, tested and removed by administrators."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from app.domain.events import EventKind
from app.domain.webhooks.webhook import MAX_HOOKS
from app.services.access import Role
from tests.support.deliveries import DELIVERED, a_plan, deliver, hook
from tests.support.events import data_of
from tests.support.reasons import words
from tests.support.service_in_process import Service, run_service
from tests.support.webhook_receiver import Receiver

PATH = "/api/v1/webhooks"


@pytest.fixture
async def receiver() -> AsyncIterator[Receiver]:
    async with Receiver().serving() as serving:
        yield serving


async def test_a_secret_is_told_once_and_never_again(
    service: Service, receiver: Receiver, capfd: pytest.CaptureFixture[str]
) -> None:
    order = {"url": receiver.url, "events": ["drop.released"], "description": "desk"}
    status, headers, made = await service.call("POST", PATH, json=order)
    assert (status, headers["Location"]) == (201, f"{PATH}/{made['webhook']['id']}")
    assert made["secret"].startswith("whsec_")
    told = [made]
    for method, path, body in (
        ("GET", PATH, None),
        ("GET", headers["Location"], None),
        ("PATCH", headers["Location"], {"description": "ward"}),
        ("POST", f"{headers['Location']}/test", None),
    ):
        told.append((await service.call(method, path, **({} if body is None else {"json": body})))[2])
    events = await service.services.journal.read(0, 500)
    shown = json.dumps(told[1:]) + "".join(event.model_dump_json() for event in events) + "".join(capfd.readouterr())
    assert made["secret"] not in shown
    assert made["webhook"]["id"] in shown


async def test_two_creations_are_two_webhooks_with_secrets_of_their_own(service: Service, receiver: Receiver) -> None:
    """No answer with a secret is kept for an Idempotency-Key."""
    headers = {"Idempotency-Key": "one"}
    made = [(await service.call("POST", PATH, json={"url": receiver.url}, headers=headers))[2] for _ in range(2)]
    assert len({one["secret"] for one in made}) == 2
    _, _, listed = await service.call("GET", PATH)
    assert [one["webhook"]["id"] for one in listed["webhooks"]] == [one["webhook"]["id"] for one in made]


async def test_a_test_message_is_signed_and_its_answer_told(service: Service, receiver: Receiver) -> None:
    hook_id, secret = await hook(service, receiver, events=["delivery.lost"])
    _, _, good = await service.call("POST", f"{PATH}/{hook_id}/test")
    assert (good["delivered"], good["status"], good["message_id"]) == (True, 200, receiver.taken[0].id)
    assert receiver.taken[0].is_signed_with(secret)
    assert receiver.taken[0].message["type"] == "webhook.test"
    receiver.plan.extend([500, "reset"])
    _, _, bad = await service.call("POST", f"{PATH}/{hook_id}/test")
    assert (bad["delivered"], bad["status"]) == (False, 500)
    _, _, worse = await service.call("POST", f"{PATH}/{hook_id}/test")
    assert (worse["delivered"], worse["status"]) == (False, None)
    assert worse["problem"]
    _, _, view = await service.call("GET", f"{PATH}/{hook_id}")
    assert view["progress"]["failures"] == 0, "a test is no delivery"


async def test_disabled_it_is_silent_and_skipping_leaves_out_what_it_missed(
    service: Service, plan: dict[str, Any], receiver: Receiver
) -> None:
    plan_id = await a_plan(service, plan)
    hook_id, _ = await hook(service, receiver)
    _, _, view = await service.call("PATCH", f"{PATH}/{hook_id}", json={"enabled": False})
    assert (view["state"], words(view["webhook"]["disabled_reason"])) == ("disabled", "disabled by local")
    await deliver(service.services.journal, plan_id, "run-1")
    await service.call("PATCH", f"{PATH}/{hook_id}", json={"enabled": True, "skip_missed": True})
    await deliver(service.services.journal, plan_id, "run-2")
    await receiver.until(lambda: receiver.types() == DELIVERED)
    assert {one.message["run"]["id"] for one in receiver.taken} == {"run-2"}


async def test_a_deleted_webhook_is_told_nothing_more_also_after_a_restart(
    tmp_path: Path, plan: dict[str, Any], receiver: Receiver
) -> None:
    async with run_service(tmp_path) as service:
        plan_id = await a_plan(service, plan)
        hook_id, _ = await hook(service, receiver)
        assert (await service.call("DELETE", f"{PATH}/{hook_id}"))[0] == 204
        status, _, problem = await service.call("GET", f"{PATH}/{hook_id}")
        assert (status, problem["code"]) == (404, "resource.not_found")
    async with Receiver().serving() as other, run_service(tmp_path) as service:
        await hook(service, other)
        await deliver(service.services.journal, plan_id, "run-1")
        await other.until(lambda: other.types() == DELIVERED)
    assert receiver.requests == []


async def test_a_changed_url_takes_the_messages_from_where_they_are(
    service: Service, plan: dict[str, Any], receiver: Receiver
) -> None:
    plan_id = await a_plan(service, plan)
    async with Receiver(usual=500).serving() as old:
        hook_id, _ = await hook(service, old)
        await deliver(service.services.journal, plan_id, "run-1")
        await old.until(lambda: bool(old.requests))
        await service.call("PATCH", f"{PATH}/{hook_id}", json={"url": receiver.url})
        await receiver.until(lambda: receiver.types() == DELIVERED)


@pytest.mark.parametrize(
    "body",
    [
        {"url": "http://receiver.example/"},
        {"url": "https://user:pw@receiver.example/"},
        {"url": "gopher://receiver.example/"},
        {"url": "https://receiver.example/", "after": 10**9},
    ],
)
async def test_what_cannot_be_sent_to_is_refused_in_words(service: Service, body: dict[str, Any]) -> None:
    status, _, problem = await service.call("POST", PATH, json=body)
    assert (status, problem["code"]) == (422, "input.invalid")
    assert (await service.call("GET", PATH))[2] == {"webhooks": []}


@pytest.mark.parametrize("body", [{"url": 5}, {}, {"url": "https://a.example/", "events": ["delivery.begun"]}])
async def test_a_body_of_another_form_is_refused(service: Service, body: dict[str, Any]) -> None:
    status, _, problem = await service.call("POST", PATH, json=body)
    assert (status, problem["code"]) == (422, "request.invalid")


async def test_a_change_that_is_refused_changes_nothing(service: Service, receiver: Receiver) -> None:
    hook_id, _ = await hook(service, receiver)
    _, _, before = await service.call("GET", f"{PATH}/{hook_id}")
    status, _, _ = await service.call("PATCH", f"{PATH}/{hook_id}", json={"url": "http://x.example/"})
    _, _, after = await service.call("GET", f"{PATH}/{hook_id}")
    assert (status, after["webhook"], after["state"]) == (422, before["webhook"], "delivering")


async def test_there_are_only_so_many(service: Service, receiver: Receiver) -> None:
    for _ in range(MAX_HOOKS):
        await hook(service, receiver)
    status, _, problem = await service.call("POST", PATH, json={"url": receiver.url})
    assert (status, problem["code"]) == (409, "state.conflict")


async def test_a_name_that_does_not_exist_is_told_in_words(service: Service) -> None:
    _, _, made = await service.call("POST", PATH, json={"url": "https://no-such-host.invalid/"})
    _, _, outcome = await service.call("POST", f"{PATH}/{made['webhook']['id']}/test")
    assert (outcome["delivered"], outcome["status"]) == (False, None)
    assert "no-such-host.invalid" in outcome["problem"]


async def test_who_did_what_to_a_webhook_is_in_the_journal(tmp_path: Path, receiver: Receiver) -> None:
    async with run_service(tmp_path) as service:
        headers = await service.token(Role.ADMIN)
        _, _, made = await service.call("POST", PATH, json={"url": receiver.url + "?key=1"}, headers=headers)
        await service.call("DELETE", f"{PATH}/{made['webhook']['id']}", headers=headers)
        events = await service.services.journal.read(0, 500)
    told = [event for event in events if event.kind is EventKind.WEBHOOK_CHANGED]
    who = [(data_of(one)["change"], data_of(one)["actor"]) for one in told]
    assert who == [
        ("created", "a admin"),
        ("deleted", "a admin"),
    ]
    assert all("key" not in one.model_dump_json() for one in told)


async def test_one_whose_key_was_lost_sends_nothing_and_says_so(
    tmp_path: Path, receiver: Receiver, plan: dict[str, Any]
) -> None:
    async with run_service(tmp_path) as service:
        _, _, made = await service.call("POST", PATH, json={"url": receiver.url})
    (tmp_path / "secret.key").unlink()
    one = f"{PATH}/{made['webhook']['id']}"
    async with run_service(tmp_path) as service:
        _, _, view = await service.call("GET", one)
        assert (view["state"], view["webhook"]["enabled"]) == ("secret_lost", True)
        status, _, problem = await service.call("POST", f"{one}/test")
        assert (status, problem["code"]) == (409, "webhook.secret_lost")
        await service.call("PATCH", one, json={"description": "still lost"})
        _, _, other = await service.call("POST", PATH, json={"url": receiver.url})
        await deliver(service.services.journal, await a_plan(service, plan), "run-1")
        await receiver.until(lambda: len(receiver.requests) >= len(DELIVERED))
        assert {request.headers["Waydrop-Webhook"] for request in receiver.requests} == {other["webhook"]["id"]}
        assert (await service.call("DELETE", one))[0] == 204
