"""Every adapter of the storage ports passes the same suite: add one to ADAPTERS and it is held to it."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager
from pathlib import Path
from typing import Protocol

import pytest

from app.domain.audit import RefusalStore
from app.domain.ports.stores import (
    AnswerStore,
    AttachmentStore,
    EventStore,
    JobStore,
    PlanStore,
    RetentionStore,
    RunStore,
    TokenStore,
)
from app.domain.webhooks.webhook import WebhookStore
from app.storage import open_storage
from app.storage.postgres import open_cluster_storage
from tests.support.cluster_servers import PostgresDatabases


class Stores(Protocol):
    """What an adapter opens."""

    @property
    def gateway_id(self) -> str: ...
    @property
    def events(self) -> EventStore: ...
    @property
    def runs(self) -> RunStore: ...
    @property
    def plans(self) -> PlanStore: ...
    @property
    def tokens(self) -> TokenStore: ...
    @property
    def answers(self) -> AnswerStore: ...
    @property
    def jobs(self) -> JobStore: ...
    @property
    def retention(self) -> RetentionStore: ...
    @property
    def attachments(self) -> AttachmentStore: ...
    @property
    def refusals(self) -> RefusalStore: ...
    @property
    def webhooks(self) -> WebhookStore: ...


Opener = Callable[[], AbstractAsyncContextManager[Stores]]

ADAPTERS: dict[str, Callable[[Path, pytest.FixtureRequest], Opener]] = {
    "sqlite": lambda folder, _: lambda: open_storage(folder / "journal.db"),
    "postgres": lambda folder, request: _postgres(folder, request.getfixturevalue("databases")),
}


def _postgres(folder: Path, databases: PostgresDatabases) -> Opener:
    url = databases.with_tables()
    return lambda: open_cluster_storage(url, key_file=folder / "secret.key")


@pytest.fixture(params=sorted(ADAPTERS))
def opener(request: pytest.FixtureRequest, tmp_path: Path) -> Opener:
    """Opens the same stores each time it is called, as a restart does."""
    return ADAPTERS[request.param](tmp_path, request)


@pytest.fixture
async def stores(opener: Opener) -> AsyncIterator[Stores]:
    """Empty stores of one adapter."""
    async with opener() as opened:
        yield opened
