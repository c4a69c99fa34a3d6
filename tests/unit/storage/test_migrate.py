"""A journal is brought to this version's tables in one step, or refused whole."""

from __future__ import annotations

import hashlib
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
import sqlalchemy as sa
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext

from app.domain.errors import StorageError
from app.storage import open_storage
from app.storage.migrate import APPLICATION_ID, MIGRATIONS, migrate
from app.storage.schema import METADATA, OFFBOARD_KINDS, REVISION
from tests.support.paths import ROOT
from tests.support.stored_samples import event

STEP = """
import sqlalchemy as sa
from alembic import op

revision = "v9999"
down_revision = {parent!r}
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table("later", sa.Column("id", sa.Integer, primary_key=True))
    {more}
"""


@contextmanager
def opened(path: Path) -> Iterator[sqlite3.Connection]:
    with closing(sqlite3.connect(path)) as connection:
        yield connection


def tables(path: Path) -> set[str]:
    with opened(path) as connection:
        return {name for (name,) in connection.execute("SELECT name FROM sqlite_schema WHERE type = 'table'")}


def definitions(path: Path) -> list[str]:
    """Of its tables, indexes and triggers."""
    with opened(path) as connection:
        return sorted(sql for (sql,) in connection.execute("SELECT sql FROM sqlite_schema WHERE sql IS NOT NULL"))


def revision(path: Path) -> str:
    with opened(path) as connection:
        return str(connection.execute("SELECT version_num FROM alembic_version").fetchone()[0])


@pytest.fixture
def journal(tmp_path: Path) -> Path:
    return tmp_path / "journal.db"


@pytest.fixture
def steps(tmp_path: Path) -> Path:
    """The steps in a folder of their own: they are run for a new journal, too."""
    return shutil.copytree(MIGRATIONS, tmp_path / "migrations")


@pytest.fixture
def later_scripts(tmp_path: Path, steps: Path) -> Path:
    """The migrations of a later version, with one more step."""
    migrate(tmp_path / "probe.db")
    (steps / "versions" / "v9999_later.py").write_text(STEP.format(parent=revision(tmp_path / "probe.db"), more=""))
    return steps


def test_the_newest_step_is_the_one_that_the_code_knows(journal: Path, steps: Path) -> None:
    migrate(journal, steps)
    assert revision(journal) == REVISION


def test_a_new_journal_has_what_the_steps_make(tmp_path: Path, journal: Path, steps: Path) -> None:
    migrate(journal)
    migrate(tmp_path / "by_steps.db", steps)
    assert definitions(journal) == definitions(tmp_path / "by_steps.db")
    assert revision(journal) == revision(tmp_path / "by_steps.db")


def test_a_step_names_one_schema_for_ever(journal: Path) -> None:
    """A journal at REVISION is not looked at again: what a schema gets more, journals that exist would never get.

    If this fails, add a step to migrations/versions, set REVISION to it, and then this hash.
    """
    migrate(journal)
    schema = hashlib.sha256("\n".join(definitions(journal)).encode()).hexdigest()
    assert (REVISION, schema) == ("journal_5", "994a76069544ca8d21bcb9f761a3d7b05537d6810532d3f2a6193600106b2c8b")


def test_a_journal_of_an_early_journal_3_gets_the_indexes_that_it_lacks(journal: Path) -> None:
    migrate(journal)
    lacking = {"ix_jobs_plan_id_position", "ix_runs_created_at_position"}
    with opened(journal) as connection, connection:
        for name in lacking:
            connection.execute(f"DROP INDEX {name}")
        connection.execute("UPDATE alembic_version SET version_num = 'journal_3'")
    migrate(journal)
    with opened(journal) as connection:
        indexes = {name for (name,) in connection.execute("SELECT name FROM sqlite_schema WHERE type = 'index'")}
    assert (lacking <= indexes, revision(journal)) == (True, REVISION)


def test_the_index_of_a_journal_4_is_made_anew(journal: Path) -> None:
    migrate(journal)
    sql = "SELECT sql FROM sqlite_schema WHERE name = 'ix_events_offboard'"
    with opened(journal) as connection, connection:
        (todays,) = connection.execute(sql).fetchone()
        connection.execute("DROP INDEX ix_events_offboard")
        connection.execute(
            "CREATE INDEX ix_events_offboard ON events (kind, vehicle_id, seq) "
            "WHERE kind IN ('offboard.lease', 'offboard.changed', 'task.changed')"
        )
        connection.execute("UPDATE alembic_version SET version_num = 'journal_4'")
    migrate(journal)
    with opened(journal) as connection:
        assert connection.execute(sql).fetchone() == (todays,)
    assert revision(journal) == REVISION


def test_no_index_fills_a_temporary_table_for_each_event_that_is_stored(journal: Path) -> None:
    migrate(journal)
    insertion = "INSERT INTO events VALUES (1, 'run.item', 1, 0.0, NULL, NULL, '{}', '')"
    with opened(journal) as connection:
        steps = {row[1] for row in connection.execute(f"EXPLAIN {insertion}")}
    assert "IdxInsert" in steps
    assert "OpenEphemeral" not in steps


def test_a_journal_that_is_new_or_up_to_date_is_opened_without_alembic(journal: Path) -> None:
    twice = (
        "import pathlib, sys; from app.storage.migrate import migrate; "
        f"path = pathlib.Path({str(journal)!r}); migrate(path); migrate(path); assert 'alembic' not in sys.modules"
    )
    subprocess.run((sys.executable, "-c", twice), cwd=ROOT, check=True)
    assert revision(journal) == REVISION


def test_the_steps_make_the_tables_that_the_code_uses(journal: Path, steps: Path) -> None:
    migrate(journal, steps)
    engine = sa.create_engine(sa.URL.create("sqlite", database=str(journal)), poolclass=sa.NullPool)
    with engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True, "compare_server_default": True})
        assert compare_metadata(context, METADATA) == []


def test_the_file_says_whose_it_is(journal: Path) -> None:
    migrate(journal)
    with opened(journal) as connection:
        assert connection.execute("PRAGMA application_id").fetchone() == (APPLICATION_ID,)


async def test_an_upgrade_keeps_what_is_in_the_journal(journal: Path, later_scripts: Path) -> None:
    async with open_storage(journal) as storage:
        stored = await storage.events.append([event(1)])
        gateway_id = storage.gateway_id
    migrate(journal, later_scripts)
    assert "later" in tables(journal)
    with opened(journal) as connection:
        assert connection.execute("SELECT seq FROM events").fetchall() == [(stored[0].seq,)]
        assert connection.execute("SELECT id FROM gateway").fetchall() == [(gateway_id,)]


async def test_a_journal_of_a_newer_version_is_refused_and_left_alone(journal: Path, later_scripts: Path) -> None:
    migrate(journal, later_scripts)
    with pytest.raises(StorageError, match="another version of Waydrop") as refused:
        async with open_storage(journal):
            pass
    assert "v9999" in refused.value.detail
    assert refused.value.hint
    assert revision(journal) == "v9999"


def test_an_upgrade_that_fails_leaves_the_old_journal(journal: Path, later_scripts: Path) -> None:
    migrate(journal)
    before = (tables(journal), revision(journal))
    step = later_scripts / "versions" / "v9999_later.py"
    step.write_text(STEP.format(parent=before[1], more='op.execute("SELECT * FROM no_such_table")'))
    with pytest.raises(StorageError, match="no_such_table"):
        migrate(journal, later_scripts)
    assert (tables(journal), revision(journal)) == before


def test_opening_again_changes_nothing(journal: Path) -> None:
    migrate(journal)
    before = (tables(journal), revision(journal))
    migrate(journal)
    assert (tables(journal), revision(journal)) == before


def test_a_database_of_another_program_is_refused_and_left_alone(journal: Path) -> None:
    with opened(journal) as connection:
        connection.execute("CREATE TABLE customers (id INTEGER)")
    with pytest.raises(StorageError, match="another program"):
        migrate(journal)
    assert tables(journal) == {"customers"}


def test_a_file_that_is_no_database_is_refused_and_left_alone(journal: Path) -> None:
    journal.write_bytes(b"MAVLink log " * 1000)
    with pytest.raises(StorageError, match="not a journal") as refused:
        migrate(journal)
    assert refused.value.extra["sqlite"] == "SQLITE_NOTADB"
    assert journal.read_bytes() == b"MAVLink log " * 1000


def test_a_folder_in_the_place_of_the_file_is_refused(journal: Path) -> None:
    journal.mkdir()
    with pytest.raises(StorageError, match="cannot be opened"):
        migrate(journal)


async def test_the_last_of_offboard_control_is_found_without_reading_the_journal(journal: Path) -> None:
    async with open_storage(journal):
        pass
    newest = f"SELECT max(seq) FROM events WHERE {OFFBOARD_KINDS} GROUP BY kind, vehicle_id"
    with opened(journal) as connection:
        plan = " ".join(str(row[3]) for row in connection.execute(f"EXPLAIN QUERY PLAN {newest}"))
    assert "COVERING INDEX ix_events_offboard" in plan
