"""`verify-journal` takes a pruned journal as it is, and finds what was altered in one."""

from __future__ import annotations

import asyncio
import json
import os
import sqlite3
from collections.abc import Sequence
from contextlib import closing
from hashlib import sha256
from pathlib import Path

import pytest

from app.domain.events.event import JournalHead, event_hash
from app.domain.events.service import JournalPruned
from app.domain.run.run import RunState
from app.services.journal import Journal
from app.services.retention import Retention, RetentionPeriods
from app.storage import Storage, open_storage, verify_journal
from app.storage.attachments import attachments_folder, file_path
from app.storage.dispatch import run_row
from tests.support.fakes import ManualClock
from tests.support.old_journal import DAY_S, TODAY_S, History
from tests.support.stored_samples import run
from tests.support.verified_journal import DOCUMENT, alter

COLUMNS = ("kind", "version", "time", "vehicle_id", "run_id", "data", "seq", "hash")
OTHER = json.dumps(DOCUMENT | {"version": 2})


@pytest.fixture
async def journal(tmp_path: Path) -> Path:
    """Events 1 to 6 were deleted. plan-1 was posted in them, and run-2 flew it since; run-1 began in them."""
    path = tmp_path / "journal.db"
    async with open_storage(path) as storage:
        history = History(storage.events)
        posted = await history.plan(1, day=1)
        await history.items(day=2, count=4)
        await history.run(1, posted, day=69, ended=71)
        await history.run(2, posted, day=90, ended=91)
        await prune(storage, days=30)
    return path


async def prune(storage: Storage, *, days: int | None = None, attachments: int | None = None) -> None:
    clock = ManualClock(TODAY_S)
    journal = Journal(storage.events, clock)
    await journal.start()
    periods = RetentionPeriods.of_days(days, attachments)
    await Retention(storage.retention, journal, clock, periods, plans_in_use=lambda: ()).prune()
    await journal.close()


def put_in(path: Path, *events: Sequence[object]) -> None:
    """As somebody with a SQLite shell would."""
    alter(path)
    with closing(sqlite3.connect(path)) as connection:
        connection.executemany(
            f"INSERT INTO events ({', '.join(COLUMNS)}) VALUES ({', '.join('?' * len(COLUMNS))})",
            events,
        )
        connection.commit()


def forged(text: str) -> dict[str, object]:
    data = json.dumps({"severity": "info", "text": text})
    return {"kind": "vehicle.status_text", "version": 1, "time": 1.0, "vehicle_id": "v1", "run_id": None, "data": data}


async def test_a_pruned_journal_is_as_written(journal: Path) -> None:
    found = await verify_journal(journal)
    assert (found.alterations, found.events, found.plans, found.runs) == ([], 6, 1, 2)
    assert found.heads[found.journal].seq == 12


@pytest.mark.parametrize(
    ("statement", "said"),
    [
        ("DELETE FROM events WHERE seq = 7", "event 8: it does not follow event 0"),
        ("DELETE FROM events WHERE seq = 9", "event 10: it does not follow event 8"),
        ("UPDATE events SET time = time + 1 WHERE seq = 7", "event 7: its hash does not follow from that of event 6"),
        ("UPDATE events SET data = replace(data, '\"seq\":6', '\"seq\":7')", "event 12: its hash is wrong"),
        ("DELETE FROM events WHERE kind = 'journal.pruned'", "event 7: it does not follow event 0"),
        (f"UPDATE plans SET document = '{OTHER}'", "plan plan-1 differs from the created one"),
        ("UPDATE plans SET id = 'plan-2'", "plan plan-1 was created and is missing"),
        ("UPDATE plans SET id = 'plan-2', created_at = 9e9", "plan plan-2 is in no event"),
        ("DELETE FROM plans", "plan plan-1 was created and is missing"),
        ("UPDATE runs SET state = 'failed' WHERE id = 'run-1'", "run run-1 differs from its events"),
        ("DELETE FROM runs WHERE id = 'run-1'", "run run-1 exists in events and is missing"),
    ],
)
async def test_what_was_altered_in_a_pruned_journal_is_found(journal: Path, statement: str, said: str) -> None:
    alter(journal, statement)
    assert any(said in line for line in (await verify_journal(journal)).alterations)


async def test_events_that_were_put_in_before_the_deleted_ones_are_found(journal: Path) -> None:
    found = await verify_journal(journal)
    head, events = JournalHead(), list[Sequence[object]]()
    for seq in (1, 2, 3):
        fields = forged(f"never seen {seq}")
        head = JournalHead(seq=seq, hash=event_hash(head.hash, gateway=found.journal, seq=seq, **fields))
        events.append((*fields.values(), seq, head.hash))
    put_in(journal, *events)
    assert (await verify_journal(journal)).alterations == [
        "event 7: it does not follow event 3; the events between them are missing"
    ]


async def test_an_event_that_was_put_in_as_the_last_deleted_one_is_found(journal: Path) -> None:
    with closing(sqlite3.connect(journal)) as connection:
        (data,) = connection.execute("SELECT data FROM events WHERE kind = 'journal.pruned'").fetchone()
    last = json.loads(data)["chains"][0]
    put_in(journal, (*forged("never seen").values(), last["seq"], last["hash"]))
    assert (await verify_journal(journal)).alterations == [
        "event 6 was deleted by age and is there again: nothing proves its content"
    ]


async def test_the_first_event_that_is_brought_back_altered_proves_nothing_and_is_told(tmp_path: Path) -> None:
    """As if a deletion by age had been broken off: the events after it prove its hash, and not its content."""
    path = tmp_path / "journal.db"
    async with open_storage(path) as storage:
        history = History(storage.events)
        await history.items(day=1, count=4)
        await history.items(day=90)
        with closing(sqlite3.connect(path)) as connection:
            (*_, hash_3), event_4 = connection.execute(f"SELECT {', '.join(COLUMNS)} FROM events WHERE seq IN (3, 4)")
        await prune(storage, days=30)
    delivered = run(9).model_copy(update={"state": RunState.COMPLETED})
    told = {**forged(""), "kind": "run.changed", "run_id": delivered.id, "data": delivered.model_dump_json()}
    put_in(path, (*told.values(), 3, hash_3), event_4)
    row = run_row(delivered)
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute(f"INSERT INTO runs ({', '.join(row)}) VALUES ({', '.join('?' * len(row))})", [*row.values()])
    found = await verify_journal(path)
    assert (found.alterations, found.unproven) == (
        [],
        [
            "event 3 is deleted by age next: nothing proves its content",
            "run run-9 is deleted by age next: nothing proves it",
        ],
    )


async def test_an_anchor_that_differs_from_the_last_deleted_event_is_found(journal: Path) -> None:
    found = await verify_journal(journal, [JournalHead(seq=6, hash="0" * 64)])
    assert (found.alterations, found.unchecked) == (["event 6: its hash differs from the anchor"], [])


async def test_retention_never_leaves_the_last_deleted_event_alone(tmp_path: Path) -> None:
    async with open_storage(tmp_path / "journal.db") as storage:
        await History(storage.events).items(day=1, count=201)
        await History(storage.events).items(day=99)
        await prune(storage, days=None)
        journal = Journal(storage.events, ManualClock(TODAY_S))
        await journal.start()
        old = await storage.retention.prunable(before=TODAY_S - 30 * DAY_S, up_to=journal.last_seq)
        assert old is not None
        pruned = JournalPruned(up_to=old.up_to, chains=old.chains, before=1.0, attachments_before=None)
        await journal.record(journal.new_event(pruned))
        await storage.retention.prune(pruned)
        await journal.close()
    assert (await verify_journal(tmp_path / "journal.db")).alterations == []


async def test_files_that_are_deleted_by_age_during_a_verification_are_no_alteration(tmp_path: Path) -> None:
    path, content = tmp_path / "journal.db", b"\xff\xd8\xff1"
    named = sha256(content).hexdigest()
    async with open_storage(path) as storage:
        history = History(storage.events)
        flown = await history.run(1, await history.plan(1, day=80), day=81, ended=81.1)
        await storage.attachments.put(named, content)
        os.utime(file_path(attachments_folder(path), named), (82 * DAY_S, 82 * DAY_S))
        await history.attach(flown, named, day=82)
        loop = asyncio.get_running_loop()

        def delete_meanwhile(_checked: int, _total: int) -> None:
            asyncio.run_coroutine_threadsafe(prune(storage, attachments=10), loop).result(timeout=10.0)

        found = await verify_journal(path, progress=delete_meanwhile)
        assert not await storage.attachments.is_intact(named)
    assert found.alterations == []


async def test_a_link_that_leads_nowhere_ends_no_round(tmp_path: Path) -> None:
    async with open_storage(tmp_path / "journal.db") as storage:
        folder = attachments_folder(tmp_path / "journal.db")
        folder.mkdir()
        link = file_path(folder, "cd" * 32)
        link.parent.mkdir()
        link.symlink_to(tmp_path / "gone")
        os.utime(link, (1.0, 1.0), follow_symlinks=False)
        await prune(storage, attachments=10)
        assert not link.is_symlink(), "it is deleted by age as any file"
