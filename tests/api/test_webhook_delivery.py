"""Webhooks over real sockets: in order, at least once, whatever the receiver does and whenever Waydrop is restarted."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from app.domain.events import EventKind
from app.domain.events.vehicle import VehicleStatusText
from app.domain.webhooks.webhook import Backoff
from app.services.webhooks import WebhookSettings
from tests.support.deliveries import DELIVERED, a_plan, deliver, hook
from tests.support.events import data_of
from tests.support.reasons import words
from tests.support.service_in_process import Service, run_service
from tests.support.webhook_receiver import Receiver


@pytest.fixture
async def receiver() -> AsyncIterator[Receiver]:
    async with Receiver().serving() as serving:
        yield serving


async def standing(service: Service, hook_id: str) -> dict[str, Any]:
    """How the webhook stands."""
    _, _, view = await service.call("GET", f"/api/v1/webhooks/{hook_id}")
    return dict(view)


async def until_state(service: Service, hook_id: str, state: str) -> dict[str, Any]:
    async with asyncio.timeout(30):
        while (view := await standing(service, hook_id))["state"] != state:
            await asyncio.sleep(0.02)
    return view


async def test_a_delivery_is_told_in_order_signed_once_and_with_its_order(
    service: Service, plan: dict[str, Any], receiver: Receiver
) -> None:
    plan_id = await a_plan(service, plan)
    hook_id, secret = await hook(service, receiver)
    await deliver(service.services.journal, plan_id, "run-1")
    await receiver.until(lambda: len(receiver.taken) == len(DELIVERED))
    assert receiver.types() == DELIVERED
    assert all(received.is_signed_with(secret) for received in receiver.taken)
    assert not receiver.taken[0].is_signed_with("whsec_" + "x" * 44)
    for received in receiver.taken:
        message = received.message
        position = f"{service.storage.gateway_id}:{message['seq']}:{message['hash'][:12]}"
        assert received.headers["webhook-id"] == received.id == position
        assert received.headers["Waydrop-Webhook"] == hook_id
        assert received.headers["Content-Type"] == "application/json"
        assert message["run"]["order_id"] == plan["order"]["id"]
        assert plan["order"]["recipient"] not in received.body.decode(), "the receiver knows its own customer"
    events = {event.seq: event for event in await service.services.journal.read(0, 500)}
    assert [events[one.message["seq"]].hash for one in receiver.taken] == [
        one.message["hash"] for one in receiver.taken
    ]
    assert receiver.taken[2].message["drop"]["certainty"] == "acknowledged"
    assert receiver.most_at_once == 1


@pytest.mark.parametrize("trouble", [500, 404, 429, "reset", "redirect", "hang"])
async def test_a_receiver_in_trouble_gets_every_message_in_order_when_it_is_well_again(
    tmp_path: Path, plan: dict[str, Any], receiver: Receiver, trouble: int | str
) -> None:
    async with run_service(tmp_path, webhook_timeout_s=0.5 if trouble == "hang" else 30.0) as service:
        plan_id = await a_plan(service, plan)
        receiver.usual = trouble
        hook_id, _ = await hook(service, receiver)
        await deliver(service.services.journal, plan_id, "run-1")
        await receiver.until(lambda: len(receiver.requests) >= 3)
        view = await until_state(service, hook_id, "retrying")
        assert view["progress"]["failures"] >= 2
        assert view["progress"]["last_status"] == {"redirect": 307, "reset": None, "hang": None}.get(
            str(trouble), trouble
        )
        assert view["progress"]["last_problem"]
        assert view["events_behind"] >= 5
        receiver.usual = 200
        await receiver.until(lambda: len(receiver.once()) >= len(DELIVERED))
        assert receiver.once() == DELIVERED
        assert {one.body for one in receiver.requests if one.type == DELIVERED[0]} == {receiver.taken[0].body}
        view = await until_state(service, hook_id, "delivering")
        assert (view["progress"]["failures"], view["progress"]["failing_since"]) == (0, None)


@pytest.mark.parametrize("trouble", ["slow", "endless"])
async def test_a_good_answer_whose_body_never_ends_is_a_good_answer(
    service: Service, plan: dict[str, Any], receiver: Receiver, trouble: str
) -> None:
    plan_id = await a_plan(service, plan)
    receiver.usual = trouble
    await hook(service, receiver)
    await deliver(service.services.journal, plan_id, "run-1")
    await receiver.until(lambda: len(receiver.taken) == len(DELIVERED))
    assert receiver.types() == DELIVERED


async def test_a_hanging_receiver_holds_up_neither_another_one_nor_the_service(
    service: Service, plan: dict[str, Any], receiver: Receiver
) -> None:
    async with Receiver(usual="hang").serving() as hanging:
        plan_id = await a_plan(service, plan)
        await hook(service, hanging)
        await hook(service, receiver)
        await deliver(service.services.journal, plan_id, "run-1")
        await hanging.until(lambda: len(hanging.requests) == 1)
        await receiver.until(lambda: receiver.types() == DELIVERED)
        assert (await service.call("GET", "/api/v1/vehicles"))[0] == 200
        assert len(hanging.requests) == 1


async def test_over_a_restart_nothing_is_lost_and_nothing_that_was_taken_comes_again(
    tmp_path: Path, plan: dict[str, Any], receiver: Receiver
) -> None:
    async with run_service(tmp_path) as service:
        plan_id = await a_plan(service, plan)
        receiver.plan.extend([200, 200])
        receiver.usual = 503
        await hook(service, receiver)
        await deliver(service.services.journal, plan_id, "run-1")
        await receiver.until(lambda: len(receiver.requests) >= 4)
    async with run_service(tmp_path) as service:
        await deliver(service.services.journal, plan_id, "run-2")
        receiver.usual = 200
        await receiver.until(lambda: len(receiver.taken) == 2 * len(DELIVERED))
    assert receiver.types() == DELIVERED * 2
    assert len({received.id for received in receiver.taken}) == 2 * len(DELIVERED)


async def test_after_a_restored_backup_no_id_is_used_again_for_another_message(
    tmp_path: Path, plan: dict[str, Any], receiver: Receiver
) -> None:
    data, backup = tmp_path / "data", tmp_path / "backup"
    data.mkdir()
    async with run_service(data) as service:
        plan_id = await a_plan(service, plan)
        await hook(service, receiver)
    shutil.copytree(data, backup)
    async with run_service(data) as service:
        await deliver(service.services.journal, plan_id, "run-1")
        await receiver.until(lambda: len(receiver.taken) == len(DELIVERED))
    async with run_service(backup) as service:
        await deliver(service.services.journal, plan_id, "run-2")
        await receiver.until(lambda: len(receiver.taken) == 2 * len(DELIVERED))
    seqs = [received.message["seq"] for received in receiver.taken]
    assert seqs[: len(DELIVERED)] == seqs[len(DELIVERED) :], "the restored journal numbers its events as before"
    assert len({received.id for received in receiver.taken}) == 2 * len(DELIVERED)


async def test_a_receiver_that_is_away_for_long_costs_no_memory_and_misses_nothing(
    tmp_path: Path, plan: dict[str, Any], receiver: Receiver
) -> None:
    small = WebhookSettings(backoff=Backoff(first_s=0.01, longest_s=0.02), queue_events=3, page_events=4)
    async with run_service(tmp_path, hooks=small) as service:
        plan_id = await a_plan(service, plan)
        receiver.usual = 500
        await hook(service, receiver)
        journal = service.services.journal
        for number in range(20):
            await deliver(journal, plan_id, f"run-{number}")
            await journal.record(
                *(journal.new_event(VehicleStatusText(severity="info", text=str(n))) for n in range(10))
            )
        await receiver.until(lambda: bool(receiver.requests))
        receiver.usual = 200
        await receiver.until(lambda: len(receiver.taken) == 20 * len(DELIVERED))
    assert receiver.types() == DELIVERED * 20
    assert [one.message["run"]["id"] for one in receiver.taken[:: len(DELIVERED)]] == [f"run-{n}" for n in range(20)]


async def test_410_disables_the_webhook_and_enabling_it_goes_on_where_it_stopped(
    service: Service, plan: dict[str, Any], receiver: Receiver
) -> None:
    plan_id = await a_plan(service, plan)
    receiver.plan.append(410)
    hook_id, _ = await hook(service, receiver)
    await deliver(service.services.journal, plan_id, "run-1")
    view = await until_state(service, hook_id, "disabled")
    assert "410" in words(view["webhook"]["disabled_reason"])
    assert len(receiver.requests) == 1
    status, _, _ = await service.call("PATCH", f"/api/v1/webhooks/{hook_id}", json={"enabled": True})
    assert status == 200
    await receiver.until(lambda: receiver.types() == DELIVERED)
    events = await service.services.journal.read(0, 500)
    told = [(data_of(one)["change"], data_of(one)["host"]) for one in events if one.kind is EventKind.WEBHOOK_CHANGED]
    assert told == [("created", "127.0.0.1"), ("disabled", "127.0.0.1"), ("enabled", "127.0.0.1")]


async def test_a_receiver_that_asks_for_time_gets_it(tmp_path: Path, plan: dict[str, Any], receiver: Receiver) -> None:
    patient = WebhookSettings(backoff=Backoff(first_s=0.01, longest_s=7200.0))
    async with run_service(tmp_path, hooks=patient) as service:
        plan_id = await a_plan(service, plan)
        receiver.usual, receiver.retry_after = 429, "3600"
        hook_id, _ = await hook(service, receiver)
        await deliver(service.services.journal, plan_id, "run-1")
        progress = (await until_state(service, hook_id, "retrying"))["progress"]
        assert progress["next_attempt_at"] - progress["last_attempt_at"] == pytest.approx(3600, abs=1)


async def test_a_webhook_is_told_only_what_it_asked_for_and_from_where_it_asked(
    service: Service, plan: dict[str, Any], receiver: Receiver
) -> None:
    plan_id = await a_plan(service, plan)
    await deliver(service.services.journal, plan_id, "before")
    async with Receiver().serving() as all_of_it:
        await hook(service, receiver, events=["delivery.completed", "delivery.failed"])
        await hook(service, all_of_it, after=0)
        await deliver(service.services.journal, plan_id, "run-1")
        await receiver.until(lambda: bool(receiver.taken))
        await all_of_it.until(lambda: len(all_of_it.taken) == 2 * len(DELIVERED))
    assert [(one.type, one.message["run"]["id"]) for one in receiver.taken] == [("delivery.completed", "run-1")]
    assert all_of_it.types() == DELIVERED * 2
