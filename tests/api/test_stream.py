"""The websocket: hello, snapshot, replay, live. Each event once, in order, whatever happens meanwhile."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import aiohttp
import pytest

from app.api import ApiServices
from app.api.stream import session
from app.domain.errors import StorageError
from app.services.fleet import Fleet
from app.services.views import VehicleView
from tests.api.broken_parts import BrokenDisk
from tests.support.listener import listen, record
from tests.support.service_in_process import SETTINGS, Service, run_service
from tests.support.socket_limits import sockets_open


async def test_hello_and_snapshot_come_first_then_what_happens(service: Service) -> None:
    await record(service, 3)
    last = service.services.journal.last_seq
    async with listen(service) as client:
        hello = await client.next_frame()
        assert (hello["type"], hello["seq"]) == ("hello", last)
        assert hello["gateway"] == service.storage.gateway_id
        snapshot = await client.next_frame()
        assert (snapshot["type"], snapshot["seq"]) == ("snapshot", last)
        assert [vehicle["id"] for vehicle in snapshot["vehicles"]] == ["v1", "v2"]
        seqs = await record(service, 5)
        assert [(await client.event())["seq"] for _ in seqs] == seqs == list(range(last + 1, last + 6))


async def test_after_replays_what_was_missed_each_once_in_order_while_more_happens(service: Service) -> None:
    await record(service, 700)

    async def follow(after: int) -> list[int]:
        async with listen(service, f"?after={after}") as client:
            return await client.seqs_to(1000)

    writer = asyncio.create_task(record(service, 400))
    results = await asyncio.gather(*(follow(after) for after in (0, 1, 499, 500, 501, 699)))
    await writer
    for after, seen in zip((0, 1, 499, 500, 501, 699), results, strict=True):
        assert seen == list(range(after + 1, 1001))


async def test_telemetry_comes_by_itself_and_is_not_an_event(service: Service) -> None:
    async with listen(service) as client:
        await client.frame("telemetry")
        service.links[0].change(heading_deg=123.0)
        while (await client.frame("telemetry"))["vehicles"]["v1"]["heading_deg"] != 123.0:
            pass


async def test_telemetry_says_whether_events_are_recorded(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    async with listen(service) as client:
        assert (await client.frame("telemetry"))["recording"]
        with monkeypatch.context() as full_disk:
            full_disk.setattr(service.storage.events, "append", BrokenDisk().append)
            with pytest.raises(StorageError):
                await record(service, 1)
            while (await client.frame("telemetry"))["recording"]:
                pass
        await record(service, 1)
        while not (await client.frame("telemetry"))["recording"]:
            pass


class WatchedFleet(Fleet):
    """A fleet that counts how often it is looked at."""

    looks = 0

    def vehicles(self) -> Sequence[VehicleView]:
        self.looks += 1
        return super().vehicles()


def watched(services: ApiServices) -> ApiServices:
    fleet = WatchedFleet.__new__(WatchedFleet)
    vars(fleet).update(vars(services.fleet))
    return replace(services, fleet=fleet)


async def test_nobody_looks_at_the_vehicles_while_no_socket_is_open(tmp_path: Path) -> None:
    async with run_service(tmp_path, change=watched) as service:
        fleet = service.services.fleet
        assert isinstance(fleet, WatchedFleet)
        async with listen(service) as client:
            for _ in range(3):
                await client.frame("telemetry")
        await sockets_open(service, 0)
        looks = fleet.looks
        assert looks >= 3
        await asyncio.sleep(10 * SETTINGS.telemetry_period_s)
        assert fleet.looks == looks


async def test_a_bad_after_closes_with_4400(service: Service) -> None:
    for bad in ("x", "-1", "1.5", "", "1&after=2", "9" * 40, "%C2%B2"):
        async with listen(service, f"?after={bad}") as client:
            assert await client.close_code() == 4400, bad


async def test_a_parameter_that_the_stream_does_not_know_closes_with_4400(service: Service) -> None:
    gateway = service.storage.gateway_id
    for bad in ("?befor=1", "?after=1&vehicle=v1", f"?gateway={gateway}", f"?after=1&gateway={gateway}&gateway=x"):
        async with asyncio.timeout(30), listen(service, bad) as client:
            assert await client.close_code() == 4400, bad


async def test_a_close_says_why_in_words_too(service: Service) -> None:
    async with service.http.ws_connect(f"{service.url}/api/v1/stream?after=x") as socket:
        message = await socket.receive()
        assert (message.type, message.data) == (aiohttp.WSMsgType.CLOSE, 4400)
        assert "non-negative integer" in message.extra


async def test_an_after_of_another_journal_closes_with_4409(service: Service) -> None:
    ahead = service.services.journal.last_seq + 1
    async with listen(service, f"?after={ahead}") as client:
        assert await client.close_code() == 4409
    async with listen(service, f"?after={ahead - 1}") as client:
        hello = await client.frame("hello")
        assert hello["seq"] == ahead - 1
    async with listen(service, f"?after={ahead - 1}&gateway={hello['gateway']}") as client:
        assert await client.frame("hello")
    async with listen(service, f"?after={ahead - 1}&gateway=gw-other") as client:
        assert await client.close_code() == 4409


async def test_a_client_that_is_cut_again_and_again_misses_nothing_and_sees_nothing_twice(service: Service) -> None:
    seen: list[int] = []
    writer = asyncio.create_task(record(service, 500))
    while len(seen) < 502:
        async with listen(service, f"?after={seen[-1] if seen else 0}") as client:
            for _ in range(min(37, 502 - len(seen))):
                seen.append((await client.event())["seq"])
    await writer
    assert seen == list(range(1, 503))


async def test_without_after_nothing_old_comes(service: Service) -> None:
    await record(service, 10)
    async with listen(service) as client:
        hello = await client.frame("hello")
        await record(service, 1)
        assert (await client.event())["seq"] == hello["seq"] + 1


async def test_a_broadcast_that_falls_behind_reads_on_from_the_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session, "SUBSCRIPTION_CAPACITY", 1)
    async with run_service(tmp_path) as service, listen(service) as client:
        await client.frame("snapshot")
        await asyncio.gather(*(record(service, 50) for _ in range(10)))
        assert await client.seqs_to(502) == list(range(3, 503))


async def test_the_snapshot_has_the_open_runs_and_the_recent_ones_once_each(
    service: Service, plan: dict[str, Any]
) -> None:
    _, _, made = await service.call("POST", "/api/v1/plans", json=plan)
    runs = []
    for vehicle in ("v1", "v2"):
        _, _, run = await service.call("POST", "/api/v1/runs", json={"plan": made["id"], "vehicle": vehicle})
        runs.append(run["id"])
    async with listen(service) as client:
        snapshot = await client.frame("snapshot")
        assert [run["id"] for run in snapshot["runs"]] == runs[::-1]
