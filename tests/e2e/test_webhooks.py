"""kill -9 in the middle of a webhook's deliveries: the next process goes on, and nothing is lost."""

from __future__ import annotations

from pathlib import Path

import aiohttp

from app.storage import open_storage
from tests.support.deliveries import DELIVERED, flown
from tests.support.forked_service import ForkedService
from tests.support.service_process import Dispatcher
from tests.support.simulated import free_udp_ports
from tests.support.stored_samples import plan
from tests.support.webhook_receiver import Receiver

RUNS = 5


async def test_a_killed_service_delivers_the_rest_and_repeats_at_most_what_it_could_not_note(
    tmp_path: Path, http: aiohttp.ClientSession
) -> None:
    async with open_storage(tmp_path / "waydrop.db") as storage:
        await storage.events.append([], plans=[plan()])
        for number in range(RUNS):
            for event, run in flown("plan-1", f"run-{number}"):
                await storage.events.append([event], [run])
    connections = (f"udpin://127.0.0.1:{free_udp_ports(1)}",)
    async with Receiver().serving() as receiver:
        receiver.plan.extend([200] * 6 + ["hang"])
        with ForkedService(tmp_path, connections) as service:
            dispatcher = Dispatcher(http, service.url)
            made = await dispatcher.post("/webhooks", {"url": receiver.url, "after": 0}, expect=201)
            await receiver.until(lambda: len(receiver.requests) == 7)
            service.kill()
            service.start()
            await receiver.until(lambda: len(receiver.once()) == RUNS * len(DELIVERED))
    assert receiver.once() == DELIVERED * RUNS
    assert all(received.is_signed_with(made["secret"]) for received in receiver.taken)
    ids = [received.id for received in receiver.requests]
    assert ids.count(ids[0]) == 1, "the first one was noted before the second was sent"
    repeated = {one for one in ids if ids.count(one) > 1}
    assert repeated <= set(ids[:7]), "only what was sent before the kill comes again"
