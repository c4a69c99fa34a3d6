"""Bring the cluster's database to this version's tables, or refuse it."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import sqlalchemy as sa
from sqlalchemy.ext.asyncio import AsyncConnection

from app.domain.errors import StorageError
from app.storage.postgres.database import PostgresDatabase

MIGRATIONS: Final = Path(__file__).parent / "migrations"
REVISION: Final = "cluster_5"
"""The newest step of migrations/versions."""

LOCK: Final = 0x57617964
"""Nodes that start together make the tables one after the other."""


async def make_current(database: PostgresDatabase) -> None:
    """Make or upgrade the tables: all steps in one transaction. Raises StorageError."""

    async def make(connection: AsyncConnection) -> None:
        await connection.execute(sa.select(sa.func.pg_advisory_xact_lock(LOCK)))
        if await connection.run_sync(_revision) != REVISION:
            await connection.run_sync(_upgrade)

    await database.transact(make)


def _revision(connection: sa.Connection) -> str | None:
    if not sa.inspect(connection).has_table("alembic_version"):
        return None
    revision = connection.exec_driver_sql("SELECT version_num FROM alembic_version").scalar()
    return None if revision is None else str(revision)


def _upgrade(connection: sa.Connection) -> None:
    from alembic import command  # here: most starts find a database that is up to date
    from alembic.config import Config
    from alembic.script import ScriptDirectory

    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS).replace("%", "%%"))
    config.attributes["connection"] = connection
    known = {script.revision for script in ScriptDirectory.from_config(config).walk_revisions()}
    revision = _revision(connection)
    if revision is not None and revision not in known:
        raise StorageError(
            f"the cluster's tables are at {revision}, which this version does not know",
            hint="install the newer version on this node",
            revision=revision,
        )
    command.upgrade(config, "head")
