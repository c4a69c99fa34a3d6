"""SIGINT and SIGTERM end the service at any time: they are all that ends the first process of a container."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from app.application import serve
from app.config import Settings, load_settings

SOON_S = 20.0


class Service:
    """What `serve` starts, slowly."""

    def __init__(self, begin: asyncio.Event, end: asyncio.Event) -> None:
        self.done: list[str] = []
        self._begin = begin
        self._end = end

    @asynccontextmanager
    async def start(self, _: Settings) -> AsyncIterator[str]:
        self.done.append("starts")
        try:
            await self._begin.wait()
            yield "http://127.0.0.1:1"
        finally:
            self.done.append("closes")
            await self._end.wait()
            self.done.append("closed")


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return load_settings(data_dir=tmp_path, hang_exit_s=0.0)


async def happened(service: Service, what: str) -> None:
    async with asyncio.timeout(SOON_S):
        while what not in service.done:
            await asyncio.sleep(0.01)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
async def test_a_signal_during_the_start_ends_it_and_undoes_what_was_begun(
    settings: Settings, number: signal.Signals
) -> None:
    end = asyncio.Event()
    service = Service(asyncio.Event(), end)
    serving = asyncio.create_task(serve(settings, start=service.start))
    await happened(service, "starts")
    os.kill(os.getpid(), number)
    await happened(service, "closes")
    os.kill(os.getpid(), number)  # a second one interrupts no cleaning up
    await asyncio.sleep(0)
    end.set()
    async with asyncio.timeout(SOON_S):
        await serving
    assert service.done == ["starts", "closes", "closed"]


async def test_a_second_signal_does_not_interrupt_the_shutdown(settings: Settings) -> None:
    begin, end, ready = asyncio.Event(), asyncio.Event(), asyncio.Event()
    begin.set()
    service = Service(begin, end)
    serving = asyncio.create_task(serve(settings, start=service.start, on_ready=lambda _: ready.set()))
    async with asyncio.timeout(SOON_S):
        await ready.wait()
    os.kill(os.getpid(), signal.SIGTERM)
    await happened(service, "closes")
    os.kill(os.getpid(), signal.SIGTERM)
    await asyncio.sleep(0)
    end.set()
    async with asyncio.timeout(SOON_S):
        await serving
    assert service.done[-1] == "closed"


async def test_another_cancellation_of_the_start_stays_one(settings: Settings) -> None:
    end = asyncio.Event()
    end.set()
    service = Service(asyncio.Event(), end)
    serving = asyncio.create_task(serve(settings, start=service.start))
    await happened(service, "starts")
    serving.cancel()
    with pytest.raises(asyncio.CancelledError):
        await serving
    assert service.done[-1] == "closed"
