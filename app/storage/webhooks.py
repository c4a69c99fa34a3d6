"""Webhooks on disk; implements WebhookStore."""

from __future__ import annotations

from collections.abc import Sequence

import sqlalchemy as sa

from app.domain.webhooks.hook import Progress, StoredWebhook, Webhook
from app.storage.database import Database
from app.storage.documents import from_json
from app.storage.schema import WEBHOOKS


class SqliteWebhookStore:
    """WebhookStore on one SQLite file."""

    def __init__(self, database: Database) -> None:
        self._database = database

    async def add(self, stored: StoredWebhook) -> None:
        """See WebhookStore. Raises StorageError, also if the id is taken."""
        row = {
            "id": stored.hook.id,
            "secret": stored.secret,
            "document": stored.hook.model_dump_json(),
            "progress": stored.progress.model_dump_json(),
        }
        await self._database.write(lambda connection: connection.execute(sa.insert(WEBHOOKS), row))

    async def list_webhooks(self) -> Sequence[StoredWebhook]:
        """See WebhookStore."""
        rows = await self._database.read(sa.select(WEBHOOKS).order_by(WEBHOOKS.c.position))
        return tuple([_stored(row) for row in rows])

    async def change(self, hook: Webhook) -> None:
        """See WebhookStore."""
        await self._set(hook.id, document=hook.model_dump_json())

    async def save_progress(self, hook_id: str, progress: Progress) -> None:
        """See WebhookStore."""
        await self._set(hook_id, progress=progress.model_dump_json())

    async def delete(self, hook_id: str) -> None:
        """See WebhookStore."""
        gone = sa.delete(WEBHOOKS).where(WEBHOOKS.c.id == hook_id)
        await self._database.write(lambda connection: connection.execute(gone))

    async def _set(self, hook_id: str, **columns: str) -> None:
        change = sa.update(WEBHOOKS).where(WEBHOOKS.c.id == hook_id).values(**columns)
        await self._database.write(lambda connection: connection.execute(change))


def _stored(row: sa.RowMapping) -> StoredWebhook:
    what = f"webhook {row['id']}"
    return StoredWebhook(
        hook=from_json(Webhook, what, row["document"]),
        secret=row["secret"],
        progress=from_json(Progress, f"the progress of {what}", row["progress"]),
    )
