"""Bring a journal file to this version's tables, or refuse it. Blocking: called in a thread, under the lock."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import sqlalchemy as sa

from app.domain.errors import StorageError
from app.storage.database import storage_errors
from app.storage.private import refuse_lost_journal
from app.storage.schema import REVISION, make_tables

APPLICATION_ID: Final = 0x57617964
"""PRAGMA application_id of a journal: "Wayd". It identifies the file as ours."""

MIGRATIONS: Final = Path(__file__).parent / "migrations"

_ALEMBICS: Final = sa.Table(
    "alembic_version",
    sa.MetaData(),
    sa.Column("version_num", sa.String(32), nullable=False),
    sa.PrimaryKeyConstraint("version_num", name="alembic_version_pkc"),
)
"""Where alembic keeps the step that a journal is at."""


def migrate(path: Path, scripts: Path = MIGRATIONS) -> None:
    """Create or upgrade the journal at `path`: all steps in one transaction, so that a kill leaves the old journal.

    A current journal is not changed, a new one made at once: alembic, which is slow to import, is only for old ones.

    Raises:
        StorageError: the file is not a journal, is of a newer Waydrop, or cannot be read or written.
    """
    with storage_errors(path), _connected(path) as connection:
        connection.exec_driver_sql("PRAGMA synchronous = FULL")
        connection.exec_driver_sql("BEGIN IMMEDIATE")
        _refuse_foreign_file(connection, path)
        if scripts == MIGRATIONS and _is_empty(connection):
            _make(connection)
        elif scripts != MIGRATIONS or _revision(connection) != REVISION:
            _upgrade(connection, path, scripts)
        connection.exec_driver_sql("COMMIT")
        _use_wal(connection, path)


def require_current(path: Path) -> None:
    """Leave the journal as it is. Raises StorageError unless it has this version's tables."""
    refuse_lost_journal(path)
    with storage_errors(path), _connected(path) as connection:
        if _revision(connection) != REVISION:
            raise StorageError(
                f"journal {path} is in use by another version of Waydrop",
                hint="use the same version, or stop the other one first",
            )


@contextmanager
def _connected(path: Path) -> Iterator[sa.Connection]:
    url = sa.URL.create("sqlite", database=str(path))
    # isolation_level None: the driver must not decide where transactions begin, for it lets DDL out of them
    engine = sa.create_engine(url, poolclass=sa.NullPool, connect_args={"isolation_level": None, "timeout": 5.0})
    try:
        with engine.connect() as connection:
            yield connection
    finally:
        engine.dispose()


def _revision(connection: sa.Connection) -> str | None:
    """Where alembic has left the journal; None if it was never there."""
    is_marked = connection.exec_driver_sql("SELECT 1 FROM sqlite_schema WHERE name = 'alembic_version'").scalar()
    if is_marked is None:
        return None
    revision = connection.exec_driver_sql("SELECT version_num FROM alembic_version").scalar()
    return None if revision is None else str(revision)


def _refuse_foreign_file(connection: sa.Connection, path: Path) -> None:
    application_id = connection.exec_driver_sql("PRAGMA application_id").scalar_one()
    if application_id != APPLICATION_ID and (application_id != 0 or not _is_empty(connection)):
        raise StorageError(
            f"{path} is a database of another program, not a journal",
            hint="use another file; Waydrop creates it if it does not exist",
        )
    connection.exec_driver_sql(f"PRAGMA application_id = {APPLICATION_ID}")


def _is_empty(connection: sa.Connection) -> bool:
    return connection.exec_driver_sql("SELECT 1 FROM sqlite_schema").first() is None


def _make(connection: sa.Connection) -> None:
    make_tables(connection)
    _ALEMBICS.create(connection)
    connection.execute(_ALEMBICS.insert(), {"version_num": REVISION})


def _use_wal(connection: sa.Connection, path: Path) -> None:
    mode = connection.exec_driver_sql("PRAGMA journal_mode = WAL").scalar_one()
    if mode != "wal":
        raise StorageError(
            f"journal {path}: its file system does not support a write-ahead log (SQLite stays in mode {mode})",
            hint="put the journal on a local disk; network file systems lack the shared memory that it needs",
        )


def _upgrade(connection: sa.Connection, path: Path, scripts: Path) -> None:
    from alembic import command  # here: most starts find a journal that is up to date, or none
    from alembic.config import Config
    from alembic.runtime.migration import MigrationContext
    from alembic.script import ScriptDirectory

    config = Config()
    config.set_main_option("script_location", str(scripts).replace("%", "%%"))
    config.attributes["connection"] = connection
    known = {script.revision for script in ScriptDirectory.from_config(config).walk_revisions()}
    for revision in MigrationContext.configure(connection).get_current_heads():
        if revision not in known:
            raise StorageError(
                f"journal {path} was written by another version of Waydrop (its tables are at {revision})",
                hint="install that version, or use another directory with --data-dir",
                revision=revision,
            )
    command.upgrade(config, "head")
