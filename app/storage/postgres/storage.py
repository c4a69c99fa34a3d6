"""Open the cluster's database and get its stores."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

import sqlalchemy as sa

from app.domain.audit import RefusalStore
from app.domain.cluster.ports import ProjectionStore
from app.domain.ports.stores import (
    AnswerStore,
    AttachmentStore,
    ClaimStore,
    PlanStore,
    RetentionStore,
    RunStore,
    TokenStore,
)
from app.domain.webhooks.webhook import WebhookStore
from app.storage.access import TableTokenStore, TableWebhookStore
from app.storage.dispatch import TablePlanStore, TableRunStore
from app.storage.postgres.access import PostgresAnswerStore, PostgresAttachmentStore, PostgresClaimStore
from app.storage.postgres.database import PostgresDatabase
from app.storage.postgres.documents import PostgresJobStore, PostgresSharedJobStore
from app.storage.postgres.events import STREAM, ClusterEventStore, PostgresProjectionStore
from app.storage.postgres.migrate import make_current
from app.storage.postgres.retention import PostgresRetentionStore
from app.storage.private import secret_box
from app.storage.refusals import TableRefusalStore


@dataclass(frozen=True, slots=True)
class ClusterStorage:
    """The stores of one database. `gateway_id` names the stream of its events, and the chain of the cluster's own."""

    gateway_id: str
    events: ClusterEventStore
    projection: ProjectionStore
    runs: RunStore
    plans: PlanStore
    tokens: TokenStore
    answers: AnswerStore
    claims: ClaimStore
    jobs: PostgresJobStore
    shared_jobs: PostgresSharedJobStore
    webhooks: WebhookStore
    attachments: AttachmentStore
    refusals: RefusalStore
    retention: RetentionStore


@asynccontextmanager
async def open_cluster_storage(
    url: str, *, key_file: Path, attachments_max_bytes: int = 10 * 1024**3
) -> AsyncIterator[ClusterStorage]:
    """Make or upgrade the tables, and give the stores until the block ends.

    `key_file` has the key of the webhooks' secrets; all nodes need the same.

    Raises:
        StorageError: PostgreSQL cannot be reached, or a newer Waydrop has made the tables.
        InvalidInputError: the URL cannot be used.
    """
    box = await asyncio.to_thread(secret_box, key_file)
    database = PostgresDatabase(url)
    try:
        await make_current(database)
        (stream,) = await database.read(sa.select(STREAM.c.id))
        yield ClusterStorage(
            gateway_id=stream["id"],
            events=ClusterEventStore(database, stream["id"]),
            projection=PostgresProjectionStore(database),
            runs=TableRunStore(database),
            plans=TablePlanStore(database),
            tokens=TableTokenStore(database),
            answers=PostgresAnswerStore(database),
            claims=PostgresClaimStore(database),
            jobs=PostgresJobStore(database),
            shared_jobs=PostgresSharedJobStore(database),
            webhooks=TableWebhookStore(database, box),
            attachments=PostgresAttachmentStore(database, attachments_max_bytes),
            refusals=TableRefusalStore(database),
            retention=PostgresRetentionStore(database),
        )
    finally:
        await database.close()
