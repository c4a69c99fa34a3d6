"""Open a journal file and get its stores."""

from __future__ import annotations

import asyncio
import secrets
import time
from collections.abc import AsyncIterator, Callable
from contextlib import ExitStack, asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

import sqlalchemy as sa
from sqlalchemy.dialects.sqlite import insert

from app.domain.audit import RefusalStore
from app.domain.cluster.ports import RelayLog
from app.domain.errors import StorageError
from app.domain.ports.stores import (
    AnswerStore,
    AttachmentStore,
    EventStore,
    FlightLog,
    JobStore,
    PlanStore,
    RetentionStore,
    RunStore,
    TokenStore,
)
from app.domain.webhooks.webhook import WebhookStore
from app.storage.access import AnswerClock, SqliteAnswerStore, SqliteTokenStore, TableWebhookStore, seal_secrets
from app.storage.attachments import ATTACHMENTS_MAX_BYTES, DiskAttachmentStore, attachments_folder, remove_unfinished
from app.storage.database import Database, JournalInUseError, exclusive_lock, no_journal
from app.storage.dispatch import TableJobStore, TablePlanStore, TableRunStore
from app.storage.events import SqliteEventStore, SqliteFlightLog
from app.storage.migrate import migrate, require_current
from app.storage.private import KEY_NAME, mark_tokens, private_file, refuse_lost_journal, refuse_lost_tokens, secret_box
from app.storage.refusals import TableRefusalStore
from app.storage.relay import RecentCommits, SqliteRelayLog
from app.storage.retention import SqliteRetentionStore
from app.storage.schema import GATEWAY, TOKENS
from app.storage.write_ahead_log import refuse_lost_commits


@dataclass(frozen=True, slots=True)
class Storage:
    """The stores of one journal file, and the id under which it numbers events."""

    path: Path
    gateway_id: str
    events: EventStore
    runs: RunStore
    plans: PlanStore
    tokens: TokenStore
    answers: AnswerStore
    jobs: JobStore
    webhooks: WebhookStore
    attachments: AttachmentStore
    flight_log: FlightLog
    refusals: RefusalStore
    relay_log: RelayLog
    retention: RetentionStore


@asynccontextmanager
async def open_storage(
    path: Path,
    *,
    attachments_max_bytes: int = ATTACHMENTS_MAX_BYTES,
    key_file: Path | None = None,
    monotonic: Callable[[], float] = time.monotonic,
) -> AsyncIterator[Storage]:
    """Lock the journal at `path`, make or upgrade its tables, and give its stores until the block ends.

    `key_file` has the key of the webhooks' secrets; without it the file `secret.key` beside the journal.

    Raises:
        StorageError: another Waydrop uses it, a newer one wrote it, or it cannot be read or written.
    """
    with exclusive_lock(path):
        await asyncio.to_thread(_make_current, path)
        await asyncio.to_thread(remove_unfinished, attachments_folder(path))
        box = await asyncio.to_thread(secret_box, key_file or path.with_name(KEY_NAME))
        database = Database(path)
        try:
            await _check_tokens(database)
            await seal_secrets(database, box)
            gateway_id = await _gateway_id(database)
            attachments = DiskAttachmentStore(database, attachments_folder(path), attachments_max_bytes)
            recent, answer_clock = RecentCommits(), AnswerClock(monotonic)
            yield Storage(
                path=path,
                gateway_id=gateway_id,
                events=SqliteEventStore(database, gateway_id, recent, answer_clock),
                runs=TableRunStore(database),
                plans=TablePlanStore(database),
                tokens=SqliteTokenStore(database),
                answers=SqliteAnswerStore(database, answer_clock),
                jobs=TableJobStore(database),
                webhooks=TableWebhookStore(database, box),
                attachments=attachments,
                flight_log=SqliteFlightLog(database),
                refusals=TableRefusalStore(database),
                relay_log=SqliteRelayLog(database, gateway_id, recent),
                retention=SqliteRetentionStore(database, gateway_id, attachments),
            )
        finally:
            await database.close()


@asynccontextmanager
async def open_tokens(path: Path) -> AsyncIterator[TokenStore]:
    """The tokens alone, for the command line: also while a Waydrop of this version runs on the journal.

    The lock guards the numbering of events; a token is one row, and SQLite keeps two writers of rows apart.

    Raises:
        StorageError: another version uses the journal, or it cannot be read or written.
    """
    with ExitStack() as held:
        try:
            held.enter_context(exclusive_lock(path))
        except JournalInUseError:
            await asyncio.to_thread(require_current, path)
        else:
            await asyncio.to_thread(_make_current, path)
        database = Database(path)
        try:
            await _check_tokens(database)
            yield SqliteTokenStore(database)
        finally:
            await database.close()


@asynccontextmanager
async def open_flight_log(path: Path) -> AsyncIterator[FlightLog]:
    """The inputs of flights alone, to be read, also while a Waydrop of this version runs on the journal.

    Raises:
        StorageError: there is no journal, another version wrote it, or it cannot be read.
    """
    if not await asyncio.to_thread(path.is_file):
        raise no_journal(path)
    await asyncio.to_thread(require_current, path)
    database = Database(path)
    try:
        yield SqliteFlightLog(database)
    finally:
        await database.close()


def _make_current(path: Path) -> None:
    """Create or upgrade the journal, for its owner alone. Blocking."""
    refuse_lost_tokens(path)
    refuse_lost_journal(path)
    try:
        private_file(path)
    except OSError as error:
        raise StorageError(
            f"journal {path}: {error.strerror or error}", hint="give the user that runs Waydrop write access to it"
        ) from error
    refuse_lost_commits(path)
    migrate(path)


async def _check_tokens(database: Database) -> None:
    (row,) = await database.read(sa.select(sa.func.count().label("tokens")).select_from(TOKENS))
    await asyncio.to_thread(refuse_lost_tokens, database.path, row["tokens"])
    if row["tokens"]:
        await asyncio.to_thread(mark_tokens, database.path)


async def _gateway_id(database: Database) -> str:
    """The ID in the file; created with the journal."""

    def read_or_make(connection: sa.Connection) -> str:
        new = {"only": 1, "id": f"gw-{secrets.token_hex(4)}"}
        connection.execute(insert(GATEWAY).on_conflict_do_nothing(), new)
        return str(connection.execute(sa.select(GATEWAY.c.id)).scalar_one())

    return await database.write(read_or_make)
