"""Prove that a journal is as it was written: its chain of events, and the plans, runs and files that these tell of."""

from __future__ import annotations

import asyncio
import sqlite3
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from app.domain.errors import StorageError
from app.domain.journal_chain import JournalHead, event_hash
from app.storage.attachments import attachments_folder, is_intact
from app.storage.errors import no_journal, storage_errors
from app.storage.migrate import APPLICATION_ID
from app.storage.told import Told

_EVENTS: Final = "SELECT seq, kind, version, time, vehicle_id, run_id, data, hash FROM events ORDER BY seq"
_HASHED: Final = ("seq", "kind", "version", "time", "vehicle_id", "run_id", "data")


@dataclass(frozen=True, slots=True)
class Verification:
    """The journal's head, how many plans, runs and files were held against its events, and what was altered.

    Each alteration is a sentence that names the event, plan, run or attachment.
    """

    gateway: str
    head: JournalHead
    plans: int
    runs: int
    attachments: int
    alterations: Sequence[str]


async def verify_journal(path: Path, anchors: Sequence[JournalHead] = ()) -> Verification:
    """Check the whole journal at `path`, also while a Waydrop runs on it. It is only read.

    The chain alone cannot show that its end was cut off, or that all of it was written anew: `anchors` are hashes that
    somebody else kept, and the journal must still have them.

    Raises:
        StorageError: there is no journal, an older Waydrop wrote it, or it cannot be read.
    """
    return await asyncio.to_thread(_verify, path, anchors)


def _verify(path: Path, anchors: Sequence[JournalHead]) -> Verification:
    with storage_errors(path), _opened(path) as connection:
        connection.execute("BEGIN")  # one snapshot, whatever is written meanwhile
        row = connection.execute("SELECT id FROM gateway").fetchone()
        gateway = "" if row is None else str(row["id"])
        told, head, found = Told(), JournalHead(), list[str]()
        kept = defaultdict[int, set[str]](set)
        for anchor in anchors:
            kept[anchor.seq].add(anchor.hash)
        for event in connection.execute(_EVENTS):
            found += _altered(event, gateway, head)
            head = JournalHead(seq=event["seq"], hash=str(event["hash"]))
            if kept.pop(head.seq, {head.hash}) != {head.hash}:
                found.append(f"event {head.seq}: its hash is not the one that was kept elsewhere")
            if not told.take(event["kind"], event["version"], event["run_id"], event["data"]):
                found.append(f"event {head.seq}: its data cannot be read")
        found += [f"event {seq} was there once, and is missing" for seq in sorted(kept)]
        found += told.altered_plans(connection.execute("SELECT * FROM plans ORDER BY position"))
        found += told.altered_runs(connection.execute("SELECT * FROM runs ORDER BY position"))
        found += told.altered_jobs(connection.execute("SELECT * FROM jobs ORDER BY position"))
        folder = attachments_folder(path)
        found += told.altered_attachments(lambda sha256: is_intact(folder, sha256))
        plans, runs = (connection.execute(f"SELECT count(*) FROM {name}").fetchone()[0] for name in ("plans", "runs"))
    return Verification(gateway, head, plans, runs, told.attachments, found)


def _altered(event: sqlite3.Row, gateway: str, head: JournalHead) -> Iterator[str]:
    if event["seq"] != head.seq + 1:
        yield f"event {event['seq']}: it does not follow event {head.seq}; what stood between them is missing"
    elif not _fits(event, gateway, head):
        yield f"event {event['seq']}: its hash does not fit; it is not what was written, or the hash before it is not"


def _fits(event: sqlite3.Row, gateway: str, head: JournalHead) -> bool:
    try:
        hashed = event_hash(head.hash, gateway=gateway, **{name: event[name] for name in _HASHED})
    except (TypeError, ValueError):  # a blob, or an infinite time: nothing that was ever written
        return False
    return bool(hashed == event["hash"])


@contextmanager
def _opened(path: Path) -> Iterator[sqlite3.Connection]:
    if not path.is_file():
        raise no_journal(path)
    # mode=ro: what a killed process left is read as it is, and nothing of it is tidied up
    uri = f"{path.absolute().as_uri()}?mode=ro"
    with closing(sqlite3.connect(uri, uri=True, timeout=5.0, isolation_level=None)) as connection:
        connection.row_factory = sqlite3.Row
        connection.text_factory = lambda text: text.decode("utf-8", "surrogateescape")
        connection.execute("PRAGMA query_only = ON")
        if connection.execute("PRAGMA application_id").fetchone()[0] != APPLICATION_ID:
            raise StorageError(f"{path} is a database of another program, not a journal")
        if not {*_HASHED, "hash"} <= {row["name"] for row in connection.execute("PRAGMA table_info(events)")}:
            raise StorageError(
                f"journal {path} was written by another version of Waydrop", hint="verify it with that version"
            )
        yield connection
