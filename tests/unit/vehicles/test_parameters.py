"""Parameters are read by several callers at once, and none of them spoils another's answer."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable

import pytest

from app.domain.errors import LinkError
from app.vehicles.encoders import Outgoing, ParamRequestRead
from app.vehicles.inbox import Inbox
from app.vehicles.parameters import ParameterReader
from app.vehicles.settings import LinkSettings

REAL32 = 9
HANG_S = 30.0


class Vehicle:
    """Answers a name only when it is told to. `asked` are all requests in order."""

    def __init__(self, timeout_s: float = HANG_S) -> None:
        self.asked: list[str] = []
        self.inbox = Inbox(asyncio.get_running_loop(), capacity=64)
        settings = LinkSettings(parameter_timeout_s=timeout_s, parameter_attempts=1)
        self.reader = ParameterReader(self._take, lambda name: None, self.inbox, settings)

    def answer(self, name: str, value: float) -> None:
        self.inbox.post("PARAM_VALUE", json.dumps({"param_id": name, "param_type": REAL32, "param_value": value}))

    def refuse(self, name: str) -> None:
        to_us = {"target_system": 245, "target_component": 190}
        self.inbox.post("PARAM_ERROR", json.dumps({**to_us, "param_id": name, "error": 1}))

    async def until(self, condition: Callable[[], bool]) -> None:
        async with asyncio.timeout(HANG_S):
            while not condition():
                await asyncio.sleep(0)

    def _take(self, message: Outgoing) -> None:
        assert isinstance(message, ParamRequestRead)
        self.asked.append(message.param_id)


async def test_two_who_read_the_same_names_at_once_both_get_them_all() -> None:
    vehicle = Vehicle()
    reads = [asyncio.create_task(vehicle.reader.read(("A", "B"))) for _ in range(2)]
    await vehicle.until(lambda: sorted(vehicle.asked) == ["A", "A", "B", "B"])
    for name, value in (("A", 1.5), ("B", 2.5)):
        vehicle.answer(name, value)
    async with asyncio.timeout(HANG_S / 2):
        assert await asyncio.gather(*reads) == [{"A": 1.5, "B": 2.5}] * 2


@pytest.mark.parametrize("gone", [0, 1])
async def test_a_reader_that_is_cancelled_takes_nothing_from_another(gone: int) -> None:
    vehicle = Vehicle()
    reads = [asyncio.create_task(vehicle.reader.read(("A",))) for _ in range(2)]
    await vehicle.until(lambda: vehicle.asked == ["A", "A"])
    reads[gone].cancel()
    await asyncio.wait({reads[gone]})
    vehicle.answer("A", 1.5)
    async with asyncio.timeout(HANG_S / 2):
        assert await reads[1 - gone] == {"A": 1.5}


async def test_closing_the_link_ends_all_who_wait() -> None:
    vehicle = Vehicle()
    reads = [asyncio.create_task(vehicle.reader.read(("A",))) for _ in range(2)]
    await vehicle.until(lambda: vehicle.asked == ["A", "A"])
    await vehicle.reader.close(timeout_s=HANG_S)
    async with asyncio.timeout(HANG_S / 2):
        ended = await asyncio.gather(*reads, return_exceptions=True)
    assert [type(one) for one in ended] == [LinkError, LinkError]


async def test_what_does_not_answer_is_not_the_same_as_what_is_not_there() -> None:
    vehicle = Vehicle(timeout_s=0.05)
    reading = asyncio.create_task(vehicle.reader.read(("THERE", "GONE", "SILENT")))
    await vehicle.until(lambda: len(vehicle.asked) == 3)
    vehicle.answer("THERE", 1.5)
    vehicle.refuse("GONE")
    async with asyncio.timeout(HANG_S):
        assert await reading == {"THERE": 1.5}
    assert vehicle.reader.unanswered == {"SILENT"}
    again = asyncio.create_task(vehicle.reader.read(("SILENT",)))
    await vehicle.until(lambda: len(vehicle.asked) == 4)
    vehicle.answer("SILENT", 2.5)
    async with asyncio.timeout(HANG_S):
        assert await again == {"SILENT": 2.5}
    assert vehicle.reader.unanswered == set()
