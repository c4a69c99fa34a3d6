"""Answers by Idempotency-Key, and attachments, in PostgreSQL."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import sqlalchemy as sa
from sqlalchemy.ext.asyncio import AsyncConnection

from app.domain.errors import AttachmentAlteredError, AttachmentQuotaError
from app.domain.events import EventKind
from app.domain.ports.stores import StoredAnswer
from app.domain.run.attachment import Attachment
from app.storage.access import KEPT_FOR_S, answer_row, stored_answer
from app.storage.database import from_json
from app.storage.postgres.database import PostgresDatabase
from app.storage.postgres.events import CLUSTER_EVENTS, PUT_ANSWER
from app.storage.schema import ANSWERS

ATTACHMENTS = sa.table("attachments", sa.column("sha256", sa.Text), sa.column("content", sa.LargeBinary))
CLAIMS = sa.table("claims", sa.column("key", sa.Text))
_CLAIM = sa.text(
    "INSERT INTO claims (key, claimed_at) VALUES (:key, extract(epoch FROM now())) ON CONFLICT (key) DO NOTHING"
)
_DROP_CLAIMS = sa.text(f"DELETE FROM claims WHERE claimed_at < extract(epoch FROM now()) - {KEPT_FOR_S}")
_DROP_ANSWERS = sa.text(f"DELETE FROM answers WHERE stored_at < extract(epoch FROM now()) - {KEPT_FOR_S}")
_PUT_FILE = sa.text(
    "INSERT INTO attachments (sha256, content) VALUES (:sha256, :content) "
    "ON CONFLICT (sha256) DO UPDATE SET attached_at = excluded.attached_at"
)
_TOUCH_FILE = sa.text("UPDATE attachments SET attached_at = extract(epoch FROM now()) WHERE sha256 = :sha256")
_USED = sa.select(sa.func.coalesce(sa.func.sum(sa.func.length(ATTACHMENTS.c.content)), 0))


class PostgresAnswerStore:
    """AnswerStore in PostgreSQL."""

    def __init__(self, database: PostgresDatabase) -> None:
        self._database = database

    async def get(self, key: str) -> StoredAnswer | None:
        rows = await self._database.read(sa.select(ANSWERS).where(ANSWERS.c.key == key))
        return stored_answer(rows[0]) if rows else None

    async def put(self, answer: StoredAnswer, *, replaces: bool = False) -> None:
        async def replace_old(connection: AsyncConnection) -> None:
            await connection.execute(_DROP_ANSWERS)
            if replaces:
                await connection.execute(sa.delete(ANSWERS).where(ANSWERS.c.key == answer.key))
            await connection.execute(PUT_ANSWER, answer_row(answer))

        await self._database.transact(replace_old)

    async def forget(self, key: str) -> None:
        gone = sa.delete(ANSWERS).where(ANSWERS.c.key == key)
        await self._database.write(lambda connection: connection.execute(gone))


class PostgresClaimStore:
    """ClaimStore in PostgreSQL."""

    def __init__(self, database: PostgresDatabase) -> None:
        self._database = database

    async def claim(self, key: str) -> bool:
        async def claim(connection: AsyncConnection) -> bool:
            await connection.execute(_DROP_CLAIMS)
            return (await connection.execute(_CLAIM, {"key": key})).rowcount == 1

        return await self._database.transact(claim)

    async def release(self, key: str) -> None:
        gone = sa.delete(CLAIMS).where(CLAIMS.c.key == key)
        await self._database.write(lambda connection: connection.execute(gone))


class PostgresAttachmentStore:
    """AttachmentStore in PostgreSQL."""

    def __init__(self, database: PostgresDatabase, max_bytes: int) -> None:
        self._database = database
        self._max_bytes = max_bytes

    async def put(self, sha256: str, content: bytes) -> None:
        async def put(connection: AsyncConnection) -> None:
            used = int((await connection.execute(_USED)).scalar_one())
            if used + len(content) > self._max_bytes:
                raise AttachmentQuotaError(
                    f"attachments take {used} of {self._max_bytes} bytes: this one does not fit",
                    hint="set WAYDROP_ATTACHMENTS_MAX_BYTES higher, if the database has room",
                )
            await connection.execute(_PUT_FILE, {"sha256": sha256, "content": content})

        if not await self._touched(sha256):
            await self._database.transact(put)

    async def _touched(self, sha256: str) -> bool:
        """Whether the file is there and intact; its age then begins anew."""

        async def touch(connection: AsyncConnection) -> bool:
            return (await connection.execute(_TOUCH_FILE, {"sha256": sha256})).rowcount == 1

        return await self.is_intact(sha256) and await self._database.transact(touch)

    async def get(self, sha256: str) -> bytes:
        query = sa.select(ATTACHMENTS.c.content).where(ATTACHMENTS.c.sha256 == sha256)
        for row in await self._database.read(query):
            content = bytes(row["content"])
            if hashlib.sha256(content).hexdigest() == sha256:
                return content
        raise AttachmentAlteredError(
            f"the stored file {sha256} is not the one that was attached, or is gone",
            hint="files that were attached on a gateway stay on it; restore others from a backup",
        )

    async def is_intact(self, sha256: str) -> bool:
        try:
            await self.get(sha256)
        except AttachmentAlteredError:
            return False
        return True

    async def of_run(self, run_id: str) -> Sequence[Attachment]:
        event = CLUSTER_EVENTS.c
        of_run = sa.select(event.data).where(event.run_id == run_id).order_by(event.position)
        rows = await self._database.read(of_run.where(event.kind == EventKind.RUN_ATTACHMENT.value))
        return tuple([from_json(Attachment, f"an attachment of run {run_id}", row["data"]) for row in rows])
