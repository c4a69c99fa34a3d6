"""Every adapter of the storage ports passes the same suite: add one to ADAPTERS and it is held to it."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager
from pathlib import Path
from typing import Protocol

import pytest

from app.domain.audit import RefusalStore
from app.domain.ports.stores import AnswerStore, EventStore, FlightLog, JobStore, PlanStore, RunStore, TokenStore
from app.domain.webhooks.webhook import WebhookStore
from app.storage import open_storage


class Stores(Protocol):
    """What an adapter opens."""

    @property
    def gateway_id(self) -> str: ...
    @property
    def events(self) -> EventStore: ...
    @property
    def runs(self) -> RunStore: ...
    @property
    def flight_log(self) -> FlightLog: ...
    @property
    def plans(self) -> PlanStore: ...
    @property
    def tokens(self) -> TokenStore: ...
    @property
    def answers(self) -> AnswerStore: ...
    @property
    def jobs(self) -> JobStore: ...
    @property
    def refusals(self) -> RefusalStore: ...
    @property
    def webhooks(self) -> WebhookStore: ...


Opener = Callable[[], AbstractAsyncContextManager[Stores]]

ADAPTERS: dict[str, Callable[[Path], Opener]] = {
    "sqlite": lambda folder: lambda: open_storage(folder / "journal.db"),
}


@pytest.fixture(params=sorted(ADAPTERS))
def opener(request: pytest.FixtureRequest, tmp_path: Path) -> Opener:
    """Opens the same stores each time it is called, as a restart does."""
    return ADAPTERS[request.param](tmp_path)


@pytest.fixture
async def stores(opener: Opener) -> AsyncIterator[Stores]:
    """Empty stores of one adapter."""
    async with opener() as opened:
        yield opened
