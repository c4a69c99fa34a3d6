"""Bearer tokens, answers by Idempotency-Key and webhooks on disk."""

from __future__ import annotations

import asyncio
import sqlite3
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.dialects.sqlite import insert

from app.domain.ports.stores import StoredAnswer, StoredToken
from app.domain.webhooks.webhook import Progress, StoredWebhook, Webhook
from app.storage.database import Database, TableAccess, from_json, object_from_json, to_json
from app.storage.private import SEALED, SecretBox, mark_tokens
from app.storage.schema import ANSWERS, TOKENS, WEBHOOKS


class TableTokenStore:
    """TokenStore on SQLite or PostgreSQL."""

    def __init__(self, database: TableAccess) -> None:
        self._database = database

    async def add(self, token: StoredToken) -> None:
        """See TokenStore. Raises StorageError, also if the id or the hash is taken."""
        row = asdict(token)
        await self._database.write(lambda connection: connection.execute(sa.insert(TOKENS), row))

    async def find_by_hash(self, token_hash: str) -> StoredToken | None:
        query = sa.select(TOKENS).where(TOKENS.c.token_hash == token_hash, TOKENS.c.revoked_at.is_(None))
        rows = await self._database.read(query)
        return _stored_token(rows[0]) if rows else None

    async def list_tokens(self) -> Sequence[StoredToken]:
        """See TokenStore. In order of creation."""
        return tuple(
            [_stored_token(row) for row in await self._database.read(sa.select(TOKENS).order_by(TOKENS.c.position))]
        )

    async def revoke(self, token_id: str, *, now: float) -> bool:
        change = sa.update(TOKENS).where(TOKENS.c.id == token_id, TOKENS.c.revoked_at.is_(None)).values(revoked_at=now)
        result = await self._database.write(lambda connection: connection.execute(change))
        return result.rowcount == 1

    async def touch(self, token_id: str, *, now: float) -> None:
        change = sa.update(TOKENS).where(TOKENS.c.id == token_id).values(last_used_at=now)
        await self._database.write(lambda connection: connection.execute(change))


class SqliteTokenStore(TableTokenStore):
    """TokenStore on one SQLite file, with the file beside it that says that tokens exist."""

    def __init__(self, database: Database) -> None:
        super().__init__(database)
        self._journal = database.path

    async def add(self, token: StoredToken) -> None:
        await super().add(token)
        await asyncio.to_thread(mark_tokens, self._journal)  # after a crash between, the next start does it


def _stored_token(row: sa.RowMapping) -> StoredToken:
    return StoredToken(**{key: value for key, value in row.items() if key != "position"})


KEPT_FOR_S: Final = 24 * 3600.0
_PUT_ANSWER: Final = (
    "INSERT INTO answers (key, request_hash, status, headers, body, stored_at) "
    "VALUES (:key, :request_hash, :status, :headers, :body, :stored_at) ON CONFLICT (key) DO NOTHING"
)
_NEWEST: Final = "SELECT max(stored_at) FROM answers"


class AnswerClock:
    """Tells the age of answers in seconds for which a Waydrop has run: it goes on from the newest answer.

    The time of day may jump: a gateway without a real-time clock boots in the past, and an answer that it stores then
    would be a day old, and its job queued twice, as soon as NTP sets the clock.
    """

    def __init__(self, monotonic: Callable[[], float] = time.monotonic) -> None:
        self._monotonic = monotonic
        self._began_s = monotonic()
        self._ahead_s: float | None = None

    def now_s(self, newest: Callable[[], float | None]) -> float:
        """`newest` reads the time of the newest answer; it is called once."""
        if self._ahead_s is None:
            self._ahead_s = (newest() or 0.0) - self._began_s
        return self._ahead_s + self._monotonic()


class SqliteAnswerStore:
    """AnswerStore on one SQLite file."""

    def __init__(self, database: Database, clock: AnswerClock) -> None:
        self._database = database
        self._clock = clock

    async def get(self, key: str) -> StoredAnswer | None:
        rows = await self._database.read(sa.select(ANSWERS).where(ANSWERS.c.key == key))
        return stored_answer(rows[0]) if rows else None

    async def put(self, answer: StoredAnswer, *, replaces: bool = False) -> None:
        def replace_old(connection: sa.Connection) -> None:
            now = self._clock.now_s(lambda: connection.execute(sa.text(_NEWEST)).scalar())
            connection.execute(sa.delete(ANSWERS).where(ANSWERS.c.stored_at < now - KEPT_FOR_S))
            row = answer_row(answer) | {"stored_at": now}
            if replaces:
                connection.execute(sa.delete(ANSWERS).where(ANSWERS.c.key == answer.key))
            connection.execute(insert(ANSWERS).on_conflict_do_nothing(index_elements=["key"]), row)

        await self._database.write(replace_old)

    async def forget(self, key: str) -> None:
        gone = sa.delete(ANSWERS).where(ANSWERS.c.key == key)
        await self._database.write(lambda connection: connection.execute(gone))


def insert_answers(connection: sqlite3.Connection, answers: Sequence[StoredAnswer], clock: AnswerClock) -> None:
    """Store answers in the transaction of the events that they tell of. The first one of a key is kept."""
    if answers:
        now = clock.now_s(lambda: connection.execute(_NEWEST).fetchone()[0])
        connection.execute("DELETE FROM answers WHERE stored_at < ?", (now - KEPT_FOR_S,))
        connection.executemany(_PUT_ANSWER, [answer_row(answer) | {"stored_at": now} for answer in answers])


def answer_row(answer: StoredAnswer) -> dict[str, Any]:
    return {
        "key": answer.key,
        "request_hash": answer.request_hash,
        "status": answer.status,
        "headers": to_json("the headers of an answer", answer.headers),
        "body": answer.body,
    }


def stored_answer(row: sa.RowMapping) -> StoredAnswer:
    return StoredAnswer(
        key=row["key"],
        request_hash=row["request_hash"],
        status=row["status"],
        headers=object_from_json("the headers of an answer", row["headers"]),
        body=row["body"],
    )


class TableWebhookStore:
    """WebhookStore on SQLite or PostgreSQL. Secrets are stored encrypted."""

    def __init__(self, database: TableAccess, box: SecretBox) -> None:
        self._database = database
        self._box = box

    async def add(self, stored: StoredWebhook) -> None:
        """See WebhookStore. Raises StorageError, also if the id is taken."""
        row = {
            "id": stored.hook.id,
            "secret": self._box.seal(stored.secret or ""),
            "document": stored.hook.model_dump_json(),
            "progress": stored.progress.model_dump_json(),
        }
        await self._database.write(lambda connection: connection.execute(sa.insert(WEBHOOKS), row))

    async def list_webhooks(self) -> Sequence[StoredWebhook]:
        rows = await self._database.read(sa.select(WEBHOOKS).order_by(WEBHOOKS.c.position))
        return tuple([_stored_webhook(row, self._box) for row in rows])

    async def change(self, hook: Webhook) -> None:
        await self._set(hook.id, document=hook.model_dump_json())

    async def save_progress(self, hook_id: str, progress: Progress) -> None:
        await self._set(hook_id, progress=progress.model_dump_json())

    async def delete(self, hook_id: str) -> None:
        gone = sa.delete(WEBHOOKS).where(WEBHOOKS.c.id == hook_id)
        await self._database.write(lambda connection: connection.execute(gone))

    async def _set(self, hook_id: str, **columns: str) -> None:
        change = sa.update(WEBHOOKS).where(WEBHOOKS.c.id == hook_id).values(**columns)
        await self._database.write(lambda connection: connection.execute(change))


async def seal_secrets(database: Database, box: SecretBox) -> None:
    """Encrypt the secrets that an older version stored as plain text, and overwrite them. Raises StorageError."""
    rows = await database.read(sa.select(WEBHOOKS.c.id, WEBHOOKS.c.secret))
    plain = [row for row in rows if not row["secret"].startswith(SEALED)]
    if not plain:
        return

    def seal(connection: sa.Connection) -> None:
        connection.exec_driver_sql("PRAGMA secure_delete = ON")
        for row in plain:
            change = sa.update(WEBHOOKS).where(WEBHOOKS.c.id == row["id"])
            connection.execute(change.values(secret=box.seal(row["secret"])))

    await database.write(seal)
    await database.write(lambda connection: connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)").close())


def _stored_webhook(row: sa.RowMapping, box: SecretBox) -> StoredWebhook:
    what = f"webhook {row['id']}"
    return StoredWebhook(
        hook=from_json(Webhook, what, row["document"]),
        secret=box.open(row["secret"]),
        progress=from_json(Progress, f"the progress of {what}", row["progress"]),
    )
