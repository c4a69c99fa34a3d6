"""The stream gives every event once and in order, however often the connection is cut."""

from __future__ import annotations

from contextlib import AsyncExitStack, aclosing

import pytest

from app.cli.service_client import EventStream, Snapshot, StreamCut, StreamItem, Telemetry, service_client
from app.cli.terminal import ServerRefusedError, ServerUnreachableError
from app.domain.events import Event
from tests.support.scripted_service import CUT, ScriptedService, event


async def read(service: ScriptedService, last_seq: int, *, after: int | None = None) -> list[StreamItem]:
    items: list[StreamItem] = []
    async with service_client(service.url, None) as client, aclosing(EventStream(client, after=after).items()) as found:
        async for item in found:
            items.append(item)
            if isinstance(item, Event) and item.seq == last_seq:
                break
    return items


def seqs(items: list[StreamItem]) -> list[int]:
    return [item.seq for item in items if isinstance(item, Event)]


async def test_snapshot_telemetry_and_events_come_through() -> None:
    async with ScriptedService([event(4), event(5)], first_seq=3).serving() as service:
        items = await read(service, 5)
    assert isinstance(items[0], Snapshot)
    assert isinstance(items[1], Telemetry)
    assert seqs(items) == [4, 5]


async def test_across_two_cuts_every_event_comes_once() -> None:
    script = [event(4), CUT, event(5), event(6), CUT, event(7)]
    async with ScriptedService(script, first_seq=3).serving() as service:
        items = await read(service, 7)
        assert service.afters == [None, "4", "6"]
    assert seqs(items) == [4, 5, 6, 7]
    assert sum(isinstance(item, StreamCut) for item in items) == 2


async def test_after_says_where_to_go_on() -> None:
    async with ScriptedService([event(1), event(2), event(3)]).serving() as service:
        assert seqs(await read(service, 3, after=1)) == [2, 3]
        assert service.afters == ["1"]


async def test_an_event_that_comes_twice_is_told_once() -> None:
    async with ScriptedService([event(1), event(1), event(2)]).serving() as service:
        assert seqs(await read(service, 2)) == [1, 2]


@pytest.mark.parametrize("code", [4401, 4409])
async def test_a_close_that_connecting_again_cannot_mend_is_an_error(code: int) -> None:
    async with ScriptedService(close_code=code).serving() as service:
        with pytest.raises(ServerRefusedError, match=str(code)):
            await read(service, 1)


async def test_nobody_at_the_address_is_told_at_once() -> None:
    async with ScriptedService().serving() as service:
        pass
    with pytest.raises(ServerUnreachableError, match="Waydrop does not respond"):
        await read(service, 1)


async def test_a_service_that_stays_away_is_given_up_after_a_while() -> None:
    service = ScriptedService([event(1), CUT])
    async with AsyncExitStack() as stack:
        serving = await stack.enter_async_context(AsyncExitStack())
        await serving.enter_async_context(service.serving())
        client = await stack.enter_async_context(service_client(service.url, None))
        items = await stack.enter_async_context(aclosing(EventStream(client, patience_s=0.3).items()))
        while not isinstance(await anext(items), StreamCut):
            pass
        await serving.aclose()
        with pytest.raises(ServerUnreachableError):
            await anext(items)
