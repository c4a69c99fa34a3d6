"""Bearer tokens on disk; implements TokenStore."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

import sqlalchemy as sa

from app.domain.ports import StoredToken
from app.storage.database import Database
from app.storage.schema import TOKENS


class SqliteTokenStore:
    """TokenStore on one SQLite file."""

    def __init__(self, database: Database) -> None:
        self._database = database

    async def add(self, token: StoredToken) -> None:
        """See TokenStore. Raises StorageError, also if the id or the hash is taken."""
        row = asdict(token)
        await self._database.write(lambda connection: connection.execute(sa.insert(TOKENS), row))

    async def find_by_hash(self, token_hash: str) -> StoredToken | None:
        """See TokenStore."""
        query = sa.select(TOKENS).where(TOKENS.c.token_hash == token_hash, TOKENS.c.revoked_at.is_(None))
        rows = await self._database.read(query)
        return _stored(rows[0]) if rows else None

    async def list_tokens(self) -> Sequence[StoredToken]:
        """See TokenStore. In order of creation."""
        return tuple([_stored(row) for row in await self._database.read(sa.select(TOKENS).order_by(TOKENS.c.position))])

    async def revoke(self, token_id: str, *, now: float) -> bool:
        """See TokenStore."""
        change = sa.update(TOKENS).where(TOKENS.c.id == token_id, TOKENS.c.revoked_at.is_(None)).values(revoked_at=now)
        result = await self._database.write(lambda connection: connection.execute(change))
        return result.rowcount == 1


def _stored(row: sa.RowMapping) -> StoredToken:
    return StoredToken(**{key: value for key, value in row.items() if key != "position"})
