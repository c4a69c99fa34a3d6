"""Whatever a thread asks the loop to call is called, once and in order, however many threads ask at a time."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator
from functools import partial

import pytest

from app.vehicles.decoders import MissionItemReached
from app.vehicles.doorbell import Doorbell
from app.vehicles.inbox import Inbox
from tests.support.driving import until


@pytest.fixture
async def doorbell() -> AsyncIterator[Doorbell]:
    made = Doorbell()
    yield made
    made.close()


async def test_each_call_of_many_threads_comes_once_and_in_its_threads_order(doorbell: Doorbell) -> None:
    seen: list[tuple[int, int]] = []
    on: set[int] = set()

    def note(thread: int, number: int) -> None:
        seen.append((thread, number))
        on.add(threading.get_ident())

    def ring(thread: int) -> None:
        for number in range(500):
            doorbell.ring(partial(note, thread, number))

    await asyncio.gather(*(asyncio.to_thread(ring, thread) for thread in range(4)))
    await until(lambda: len(seen) >= 2000, "all are called", 10.0)
    assert on == {threading.get_ident()}, "all on the loop's thread"
    for thread in range(4):
        assert [number for one, number in seen if one == thread] == list(range(500))


async def test_a_call_that_fails_keeps_none_of_the_others_from_being_called(doorbell: Doorbell) -> None:
    failed: list[BaseException] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: failed.append(context["exception"]))
    called: list[str] = []

    def fail() -> None:
        raise ValueError("a listener's error")

    for call in (fail, lambda: called.append("first"), fail, lambda: called.append("second")):
        doorbell.ring(call)
    await until(lambda: len(called) == 2, "those beside it are called", 10.0)
    assert called == ["first", "second"]
    assert [str(error) for error in failed] == ["a listener's error"] * 2


async def test_calls_that_take_long_leave_the_loop_turns_for_others(doorbell: Doorbell) -> None:
    called: list[float] = []
    for _ in range(20):
        doorbell.ring(lambda: (time.sleep(0.005), called.append(time.monotonic())))
    turns = 0
    while len(called) < 20:
        await asyncio.sleep(0)
        turns += 1
    assert turns >= 20


async def test_nothing_is_called_after_it_was_closed(doorbell: Doorbell) -> None:
    called: list[str] = []
    doorbell.ring(lambda: called.append("late"))
    doorbell.close()
    doorbell.close()
    for _ in range(3):
        await asyncio.sleep(0)
    assert called == []


async def test_messages_of_many_vehicles_reach_their_listeners_through_one_doorbell(doorbell: Doorbell) -> None:
    seen: dict[int, list[int]] = {}
    inboxes = [Inbox(asyncio.get_running_loop(), capacity=512, wake=doorbell.ring) for _ in range(10)]
    for vehicle, inbox in enumerate(inboxes):
        heard = seen.setdefault(vehicle, [])
        inbox.on(MissionItemReached, lambda message, _, heard=heard: heard.append(message.seq))

    def post() -> None:
        for seq in range(200):
            for inbox in inboxes:
                inbox.post("MISSION_ITEM_REACHED", f'{{"seq": {seq}}}')

    await asyncio.to_thread(post)
    await until(lambda: all(len(heard) >= 200 for heard in seen.values()), "every listener has all", 10.0)
    assert all(heard == list(range(200)) for heard in seen.values())
    for inbox in inboxes:
        inbox.close()
