"""Answers by Idempotency-Key on disk; implements AnswerStore."""

from __future__ import annotations

from typing import Final

import sqlalchemy as sa
from sqlalchemy.dialects.sqlite import insert
from sqlalchemy.ext.asyncio import AsyncConnection

from app.domain.ports import StoredAnswer
from app.storage.database import Database
from app.storage.documents import object_from_json, to_json
from app.storage.schema import ANSWERS

KEPT_FOR_S: Final = 24 * 3600.0


class SqliteAnswerStore:
    """AnswerStore on one SQLite file."""

    def __init__(self, database: Database) -> None:
        self._database = database

    async def get(self, key: str) -> StoredAnswer | None:
        """See AnswerStore."""
        rows = await self._database.read(sa.select(ANSWERS).where(ANSWERS.c.key == key))
        return _stored(rows[0]) if rows else None

    async def put(self, answer: StoredAnswer, *, now: float) -> None:
        """See AnswerStore. The first answer of a key stands: a replay must always say the same."""
        row = {
            "key": answer.key,
            "request_hash": answer.request_hash,
            "status": answer.status,
            "headers": to_json("the headers of an answer", answer.headers),
            "body": answer.body,
            "stored_at": now,
        }

        async def replace_old(connection: AsyncConnection) -> None:
            await connection.execute(sa.delete(ANSWERS).where(ANSWERS.c.stored_at < now - KEPT_FOR_S))
            await connection.execute(insert(ANSWERS).on_conflict_do_nothing(index_elements=["key"]), row)

        await self._database.write(replace_old)


def _stored(row: sa.RowMapping) -> StoredAnswer:
    return StoredAnswer(
        key=row["key"],
        request_hash=row["request_hash"],
        status=row["status"],
        headers=object_from_json("the headers of an answer", row["headers"]),
        body=row["body"],
    )
