"""`verify-journal` shows whatever was altered behind Waydrop's back, and nothing else."""

from __future__ import annotations

import asyncio
import json
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from app.domain.errors import StorageError
from app.domain.events.event import GENESIS, JournalHead
from app.domain.plan.document import document_hash
from app.storage import Verification, open_storage, verify, verify_journal
from app.storage.chains import HASHED
from tests.support.stored_samples import event
from tests.support.verified_journal import DOCUMENT, alter, write_journal

OTHER = DOCUMENT | {"version": 2}
OTHER_PLAN = json.dumps(OTHER)


_WRITTEN: list[bytes] = []
"""Made once: migrating a new file takes longer than a test."""


@pytest.fixture
async def journal(tmp_path: Path) -> Path:
    """Six events: three of no run, then a plan, a run and its drop. As a service would have stored them."""
    path = tmp_path / "journal.db"
    if not _WRITTEN:
        await write_journal(path)
        _WRITTEN.append(await asyncio.to_thread(path.read_bytes))
    await asyncio.to_thread(path.write_bytes, _WRITTEN[0])
    return path


def head_of(found: Verification) -> JournalHead:
    return found.heads[found.journal]


async def head(path: Path) -> JournalHead:
    return head_of(await verify_journal(path))


async def test_a_journal_as_written_is_found_so_with_all_its_parts_counted(journal: Path) -> None:
    found = await verify_journal(journal)
    assert found.alterations == []
    assert (head_of(found).seq, found.plans, found.runs) == (6, 1, 1)
    assert found.journal.startswith("gw-")


async def test_the_head_is_the_hash_that_the_newest_event_carries(journal: Path) -> None:
    async with open_storage(journal) as storage:
        (newest,) = await storage.events.append([event(7)])
        assert await storage.events.read(after=6, limit=9) == (newest,)
        assert await head(journal) == JournalHead(seq=7, hash=newest.hash)


async def test_progress_is_told_as_events_are_checked(journal: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(verify, "PROGRESS_EVENTS", 2)
    new_event: list[tuple[int, int]] = []
    await verify_journal(journal, progress=lambda checked, total: new_event.append((checked, total)))
    assert new_event == [(0, 6), (2, 6), (4, 6)]


async def test_an_empty_journal_is_as_written(tmp_path: Path) -> None:
    async with open_storage(tmp_path / "journal.db"):
        pass
    found = await verify_journal(tmp_path / "journal.db")
    assert (found.alterations, head_of(found)) == ([], JournalHead(seq=0, hash=GENESIS))


@pytest.mark.parametrize(
    "change",
    [
        "kind = 'run.ack'",
        "version = 2",
        "time = time + 0.001",
        "vehicle_id = 'v2'",
        "vehicle_id = NULL",
        "run_id = 'run-9'",
        "data = replace(data, '2', '3')",
        "data = data || ' '",
        "hash = upper(hash)",
        f"hash = '{GENESIS}'",
    ],
)
async def test_any_altered_field_of_an_event_is_found_and_named(journal: Path, change: str) -> None:
    alter(journal, f"UPDATE events SET {change} WHERE seq = 2")
    assert any(line.startswith("event 2: ") for line in (await verify_journal(journal)).alterations)


async def test_every_column_of_an_event_is_covered_by_its_hash(journal: Path) -> None:
    with closing(sqlite3.connect(journal)) as connection:
        columns = {row[1] for row in connection.execute("PRAGMA table_info(events)")}
    assert columns - {"hash"} == set(HASHED)


@pytest.mark.parametrize(
    ("statements", "said"),
    [
        (["DELETE FROM events WHERE seq = 2"], "event 3: it does not follow event 1"),
        (["DELETE FROM events WHERE seq < 3"], "event 3: it does not follow event 0"),
        (["DELETE FROM events WHERE seq = 2", "UPDATE events SET seq = seq - 1 WHERE seq > 2"], "event 2: its hash"),
        (["UPDATE gateway SET id = 'gw-other'"], "event 1: its hash"),
        ([f"UPDATE plans SET document = '{OTHER_PLAN}'"], "plan plan-1 differs from the created one"),
        (
            [f"UPDATE plans SET document = '{OTHER_PLAN}', hash = '{document_hash(OTHER)}'"],
            "plan plan-1 differs from the created one",
        ),
        (["DELETE FROM plans"], "plan plan-1 was created and is missing"),
        (
            ["UPDATE runs SET document = replace(document, 'released', 'kept')"],
            "run run-1 differs from its events",
        ),
        (["UPDATE runs SET document = '{}'"], "run run-1 differs from its events: it cannot be read"),
        (["DELETE FROM runs"], "run run-1 exists in events and is missing"),
        (["UPDATE runs SET id = 'run-2'"], "run run-2 is in no event"),
    ],
)
async def test_what_is_taken_out_or_swapped_is_found(journal: Path, statements: list[str], said: str) -> None:
    alter(journal, *statements)
    assert any(line.startswith(said) for line in (await verify_journal(journal)).alterations)


@pytest.mark.parametrize("seq", [0, -1])
async def test_an_event_before_the_first_proves_nothing_and_is_found(journal: Path, seq: int) -> None:
    """Its hash needs no knowledge of the journal: that before event 1 is known to everybody."""
    columns = "kind, version, time, vehicle_id, data"
    alter(
        journal,
        f"INSERT INTO events (seq, run_id, hash, {columns}) "
        f"SELECT {seq}, 'run-2', '{GENESIS}', {columns} FROM events WHERE kind = 'run.created'",
        f"UPDATE events SET data = replace(data, 'run-1', 'run-2') WHERE seq = {seq}",
        "INSERT INTO runs SELECT position + 1, 'run-2', plan_id, vehicle_id, is_over, "
        "replace(document, 'run-1', 'run-2'), state, created_at FROM runs",
    )
    kept = JournalHead(seq=6, hash=(await head(journal)).hash)
    assert (await verify_journal(journal, [kept])).alterations == [
        f"event {seq}: no journal has such a number",
        "run run-2 is in no event",
    ]


async def test_an_index_that_hides_an_event_is_found(journal: Path) -> None:
    """The service finds the events of a run by an index, and would not show this one."""
    made = "SELECT sql FROM sqlite_schema WHERE name = 'ix_events_run_id_seq'"
    with closing(sqlite3.connect(journal)) as connection:
        (sql,) = connection.execute(made).fetchone()
        connection.execute("DROP INDEX ix_events_run_id_seq")
        connection.execute(f"{sql} AND seq <> 6")
        connection.execute("PRAGMA writable_schema = ON")
        connection.execute("UPDATE sqlite_schema SET sql = ? WHERE name = 'ix_events_run_id_seq'", (sql,))
        connection.commit()
    assert "row 6 missing from index ix_events_run_id_seq" in (await verify_journal(journal)).alterations


async def rewritten(path: Path) -> Verification:
    """The last event is cut off, with what it told; the chain itself has no flaw then."""
    alter(
        path, "DELETE FROM events WHERE seq = 6", "UPDATE runs SET document = replace(document, 'released', 'pending')"
    )
    return await verify_journal(path)


async def test_an_end_that_was_cut_off_shows_against_an_anchor_that_somebody_kept(journal: Path) -> None:
    kept = await head(journal)
    await rewritten(journal)
    found = await verify_journal(journal, [kept])
    assert "event 6 existed and is missing" in found.alterations


async def test_a_journal_written_anew_shows_against_an_anchor(journal: Path) -> None:
    found = await verify_journal(journal, [JournalHead(seq=3, hash="ab" * 32)])
    assert found.alterations == ["event 3: its hash differs from the anchor"]


async def test_an_anchor_that_is_still_there_proves_all_up_to_it(journal: Path) -> None:
    kept = await head(journal)
    async with open_storage(journal) as storage:
        await storage.events.append([event(7)])
        assert (await verify_journal(journal, [kept])).alterations == []


async def test_verifying_changes_nothing_and_makes_no_journal(journal: Path, tmp_path: Path) -> None:
    before = await asyncio.to_thread(journal.read_bytes)
    await verify_journal(journal)
    assert await asyncio.to_thread(journal.read_bytes) == before
    with pytest.raises(StorageError, match="there is no journal"):
        await verify_journal(tmp_path / "other.db")
    assert not (tmp_path / "other.db").exists()


@pytest.mark.parametrize(
    "change",
    [
        "json_remove(document, '$.drops')",
        "json_remove(document, '$.plan_hash')",
        "json_set(document, '$.firmware', 'x')",
    ],
)
async def test_a_run_that_lost_or_gained_a_field_is_found(journal: Path, change: str) -> None:
    alter(journal, f"UPDATE runs SET document = {change}")
    assert (await verify_journal(journal)).alterations


@pytest.mark.parametrize(
    "change",
    [
        "runs SET is_over = 1",
        "runs SET vehicle_id = 'v2'",
        "runs SET state = 'completed'",
        "runs SET created_at = 0",
        "plans SET name = 'another'",
        "plans SET created_by = 'nobody'",
        "plans SET created_at = 0",
        "plans SET vehicle_type = 'rover'",
    ],
)
async def test_a_column_beside_a_document_is_held_to_it(journal: Path, change: str) -> None:
    alter(journal, f"UPDATE {change}")
    assert len((await verify_journal(journal)).alterations) == 1


async def test_a_plan_that_no_event_announced_is_found_and_one_that_was_flown_is_held_to_the_run(journal: Path) -> None:
    alter(
        journal,
        "INSERT INTO plans SELECT 9, 'plan-9', hash, name, vehicle_type, created_at, created_by, document FROM plans",
    )
    assert (await verify_journal(journal)).alterations == ["plan plan-9 is in no event"]


@pytest.mark.parametrize(
    "rubbish",
    [
        "events SET data = x'00ff' WHERE seq = 2",
        "events SET kind = x'00ff' WHERE seq = 2",
        "events SET hash = x'00ff' WHERE seq = 2",
        "events SET time = 9e999 WHERE seq = 2",
        "events SET data = CAST(x'22ff22' AS TEXT) WHERE seq = 2",
        "events SET data = '{\"drops\":5}' WHERE seq = 5",
        "events SET data = '{\"drops\":[5]}' WHERE seq = 5",
        "runs SET document = '" + "[" * 20_000 + "'",
        "plans SET document = x'00'",
    ],
)
async def test_rubbish_ends_in_a_verdict_and_not_in_a_crash(journal: Path, rubbish: str) -> None:
    alter(journal, f"UPDATE {rubbish}")
    assert (await verify_journal(journal)).alterations


async def test_two_clients_that_kept_different_hashes_of_one_event_are_both_heard(journal: Path) -> None:
    kept = await head(journal)
    for anchors in ([kept, JournalHead(seq=6, hash="ab" * 32)], [JournalHead(seq=6, hash="ab" * 32), kept]):
        assert (await verify_journal(journal, anchors)).alterations


async def test_what_a_killed_service_left_is_checked_and_stays_as_it_is(journal: Path, tmp_path: Path) -> None:
    left = tmp_path / "left"
    await asyncio.to_thread(left.mkdir)
    async with open_storage(journal) as storage:
        await storage.events.append([event(7)])
        for name in ("journal.db", "journal.db-wal"):
            await asyncio.to_thread(shutil.copy, tmp_path / name, left / name)
    before = {path.name: path.read_bytes() for path in left.iterdir()}
    found = await verify_journal(left / "journal.db")
    assert (head_of(found).seq, found.alterations) == (7, [])
    assert {name: (left / name).read_bytes() for name in before} == before


async def test_a_journal_is_checked_where_nothing_can_be_written(journal: Path) -> None:
    """SQLite wants a file beside it, which a read-only medium does not take, nor a folder if its name is too long."""
    copy = await asyncio.to_thread(journal.rename, journal.with_name("j" * 252))
    found = await verify_journal(copy)
    assert (found.alterations, found.events) == ([], 6)
