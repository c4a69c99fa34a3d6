"""Prove that a journal is as it was written: its chain of events, and the plans, runs and files that these name."""

from __future__ import annotations

import asyncio
import os
import sqlite3
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from app.domain.errors import StorageError
from app.domain.events.event import JournalHead
from app.storage.attachments import attachments_folder, is_intact
from app.storage.chains import HASHED, Chains
from app.storage.database import no_journal, storage_errors
from app.storage.journal_index import JournalIndex
from app.storage.migrate import APPLICATION_ID

_EVENTS: Final = "SELECT seq, kind, version, time, vehicle_id, run_id, data, hash FROM events ORDER BY seq"
_PRUNED: Final = (
    "SELECT kind, version, run_id, data FROM events WHERE kind = 'journal.pruned' AND seq > 0 ORDER BY seq DESC"
)


@dataclass(frozen=True, slots=True)
class Verification:
    """The newest event of each chain, by the gateway that wrote it; the number of events, and of plans, runs and files
    that were compared with them; and the alterations.

    `journal` is the gateway, or the stream of a cluster, which has the chains of several. Each alteration is a sentence
    that names the event, plan, run or attachment. `unchecked` are anchors of events that were deleted by age.
    `unproven` are sentences about what a deletion by age that goes on, or was broken off, has left without a proof.
    """

    journal: str
    heads: Mapping[str, JournalHead]
    events: int
    plans: int
    runs: int
    attachments: int
    alterations: Sequence[str]
    unchecked: Sequence[JournalHead] = ()
    unproven: Sequence[str] = ()


PROGRESS_EVENTS: Final = 10_000
Progress = Callable[[int, int], None]
"""How many events were checked, of how many. Called in another thread, every PROGRESS_EVENTS."""


async def verify_journal(
    path: Path, anchors: Sequence[JournalHead] = (), progress: Progress = lambda checked, total: None
) -> Verification:
    """Check the whole journal at `path`, also while a Waydrop runs on it. It is only read.

    The chain alone cannot show that its end was truncated, or that all of it was rewritten: `anchors` are hashes stored
    elsewhere, which the journal must contain.

    Raises:
        StorageError: there is no journal, an older Waydrop wrote it, or it cannot be read.
    """
    return await asyncio.to_thread(_verify, path, anchors, progress)


def _verify(path: Path, anchors: Sequence[JournalHead], progress: Progress) -> Verification:
    with storage_errors(path), _opened(path) as connection:
        connection.execute("BEGIN")  # one snapshot, whatever is written meanwhile
        row = connection.execute("SELECT id FROM gateway").fetchone()
        gateway = "" if row is None else str(row["id"])
        index, deleted, chains, found = JournalIndex(), JournalIndex(), Chains(), list[str]()
        for pruned in connection.execute(_PRUNED):
            deleted.take(*pruned)
        missing = defaultdict[int, set[str]](set)
        for anchor in anchors:
            missing[anchor.seq].add(anchor.hash)
        total = connection.execute("SELECT count(*) FROM events").fetchone()[0]
        for event in connection.execute(_EVENTS):
            if chains.events % PROGRESS_EVENTS == 0:
                progress(chains.events, total)
            is_first = gateway not in chains.heads
            found += chains.take(gateway, event)
            if missing.pop(event["seq"], {event["hash"]}) != {event["hash"]}:
                found.append(f"event {event['seq']}: its hash differs from the anchor")
            if is_first and deleted.is_left_over(gateway, event):
                index.set_aside(event)
            elif event["seq"] > 0 and not index.take(event["kind"], event["version"], event["run_id"], event["data"]):
                found.append(f"event {event['seq']}: its data cannot be read")
        found += [text for gap in chains.gaps for text in index.unexplained(gap, is_whole=True)]
        unknown = [anchor for anchor in anchors if anchor.seq in missing]
        lost = dict(index.unknown(sorted(unknown, key=lambda anchor: anchor.seq), chains))
        found += [text for text in lost.values() if text]
        found += index.altered_plans(connection.execute("SELECT * FROM plans ORDER BY position"))
        found += index.altered_runs(connection.execute("SELECT * FROM runs ORDER BY position"))
        found += index.altered_jobs(connection.execute("SELECT * FROM jobs ORDER BY position"))
        found += index.altered_queues(connection.execute("SELECT * FROM job_queues ORDER BY vehicle_id"))
        found += [line for (line,) in connection.execute("PRAGMA integrity_check") if line != "ok"]  # e.g. of an index
        plans, runs = (connection.execute(f"SELECT count(*) FROM {name}").fetchone()[0] for name in ("plans", "runs"))
        found += _altered_files(connection, index, attachments_folder(path))
    unchecked = [anchor for anchor, text in lost.items() if not text]
    heads = {gateway: chains.heads[gateway]}
    return Verification(gateway, heads, chains.events, plans, runs, index.attachments, found, unchecked, index.unproven)


def _altered_files(connection: sqlite3.Connection, index: JournalIndex, folder: Path) -> Sequence[str]:
    """See JournalIndex.altered_attachments. Files are in no snapshot: some may have been deleted by age meanwhile."""

    def altered() -> Sequence[str]:
        return list(index.altered_attachments(lambda sha256: is_intact(folder, sha256)))

    if not (found := altered()):
        return ()
    connection.execute("COMMIT")
    newest = connection.execute(_PRUNED).fetchone()
    return altered() if newest is not None and index.take(*newest) else found


def _connected(path: Path) -> sqlite3.Connection:
    """SQLite needs a file beside a journal to read it. Where it cannot make one, it reads one that nobody writes."""
    uri, wal = f"{path.absolute().as_uri()}?mode=ro", f"{path}-wal"
    for more in ("", "&immutable=1"):
        connection = sqlite3.connect(uri + more, uri=True, timeout=5.0, isolation_level=None)
        try:
            connection.execute("PRAGMA schema_version")
        except sqlite3.OperationalError as error:
            connection.close()
            is_left = os.path.exists(wal) and os.path.getsize(wal) > 0
            if more or is_left or error.sqlite_errorname != "SQLITE_CANTOPEN":
                raise
        else:
            break
    return connection


@contextmanager
def _opened(path: Path) -> Iterator[sqlite3.Connection]:
    if not path.is_file():
        raise no_journal(path)
    # mode=ro: the leftovers of a killed process are read but not cleaned up
    with closing(_connected(path)) as connection:
        connection.row_factory = sqlite3.Row
        connection.text_factory = lambda text: text.decode("utf-8", "surrogateescape")
        connection.execute("PRAGMA query_only = ON")
        if connection.execute("PRAGMA application_id").fetchone()[0] != APPLICATION_ID:
            raise StorageError(f"{path} is a database of another program, not a journal")
        if not {*HASHED, "hash"} <= {row["name"] for row in connection.execute("PRAGMA table_info(events)")}:
            raise StorageError(
                f"journal {path} was written by another version of Waydrop",
                hint="verify it with that version of Waydrop",
            )
        yield connection
