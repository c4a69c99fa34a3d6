"""The websocket: hello, snapshot, replay, live."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

import aiohttp

from app.domain.events import EventKind
from tests.api.service import Service


@dataclass
class Listener:
    """One client of the stream."""

    socket: aiohttp.ClientWebSocketResponse

    async def frame(self, *kinds: str) -> dict[str, Any]:
        """The next frame of these types; others are passed over."""
        async with asyncio.timeout(5):
            while True:
                frame: dict[str, Any] = await self.socket.receive_json()
                if frame["type"] in kinds:
                    return frame

    async def event(self) -> dict[str, Any]:
        """The next event."""
        event: dict[str, Any] = (await self.frame("event"))["event"]
        return event

    async def close_code(self) -> int | None:
        """Read to the end."""
        async with asyncio.timeout(5):
            async for _ in self.socket:
                pass
        return self.socket.close_code


@asynccontextmanager
async def listen(service: Service, query: str = "", **options: Any) -> AsyncIterator[Listener]:
    """Open the stream."""
    async with service.http.ws_connect(f"{service.url}/api/v1/stream{query}", **options) as socket:
        yield Listener(socket)


async def record(service: Service, count: int) -> list[int]:
    """Record events in several calls. Their numbers."""
    journal = service.services.journal
    seqs: list[int] = []
    for number in range(count):
        stored = await journal.record(journal.new_event(EventKind.VEHICLE_STATUS_TEXT, vehicle_id="v1", n=number))
        seqs.append(stored[0].seq)
    return seqs


async def test_hello_and_snapshot_come_first_then_what_happens(service: Service) -> None:
    await record(service, 3)
    last = service.services.journal.last_seq
    async with listen(service) as client:
        hello = await client.socket.receive_json()
        assert (hello["type"], hello["seq"]) == ("hello", last)
        assert hello["gateway"] == service.storage.gateway_id
        snapshot = await client.socket.receive_json()
        assert (snapshot["type"], snapshot["seq"]) == ("snapshot", last)
        assert [vehicle["id"] for vehicle in snapshot["vehicles"]] == ["v1", "v2"]
        seqs = await record(service, 5)
        assert [(await client.event())["seq"] for _ in seqs] == seqs == list(range(last + 1, last + 6))


async def test_after_replays_what_was_missed_each_once_in_order_while_more_happens(service: Service) -> None:
    await record(service, 700)

    async def follow(after: int) -> list[int]:
        async with listen(service, f"?after={after}") as client:
            seen: list[int] = []
            while not seen or seen[-1] < 1000:
                seen.append((await client.event())["seq"])
            return seen

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


async def test_a_bad_after_closes_with_4400(service: Service) -> None:
    for bad in ("x", "-1", "1.5", "", "1&after=2", "9" * 40, "%C2%B2"):
        async with listen(service, f"?after={bad}") as client:
            assert await client.close_code() == 4400, bad


async def test_an_after_of_another_journal_closes_with_4409(service: Service) -> None:
    ahead = service.services.journal.last_seq + 1
    async with listen(service, f"?after={ahead}") as client:
        assert await client.close_code() == 4409
    async with listen(service, f"?after={ahead - 1}") as client:
        assert (await client.frame("hello"))["seq"] == ahead - 1
