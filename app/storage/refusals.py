"""Rejected requests on disk, for the audit; implements RefusalStore."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

import sqlalchemy as sa

from app.domain.audit import MOST_REFUSALS, RejectedRequests
from app.storage.database import TableAccess
from app.storage.schema import REFUSALS


class TableRefusalStore:
    """RefusalStore on SQLite or PostgreSQL."""

    def __init__(self, database: TableAccess, *, most: int = MOST_REFUSALS) -> None:
        self._database = database
        self._most = most

    async def add(self, refusals: Sequence[RejectedRequests]) -> None:
        rows = [asdict(refusal) for refusal in refusals]

        def insert(connection: sa.Connection) -> None:
            connection.execute(sa.insert(REFUSALS), rows)
            for of_users in (REFUSALS.c.actor != "", REFUSALS.c.actor == ""):
                newest = sa.select(REFUSALS.c.position).where(of_users).order_by(REFUSALS.c.position.desc())
                last_kept = newest.limit(1).offset(self._most - 1).scalar_subquery()
                connection.execute(sa.delete(REFUSALS).where(of_users, REFUSALS.c.position < last_kept))

        if rows:
            await self._database.write(insert)

    async def newest(self, *, before: int | None, limit: int) -> Sequence[tuple[int, RejectedRequests]]:
        query = sa.select(REFUSALS).order_by(REFUSALS.c.position.desc()).limit(limit)
        if before is not None:
            query = query.where(REFUSALS.c.position < before)
        rows = [dict(row) for row in await self._database.read(query)]
        return tuple([(row.pop("position"), RejectedRequests(**row)) for row in rows])
