"""The file itself refuses to forget: even another program with the file open cannot change an event by SQL."""

from __future__ import annotations

import sqlite3
from collections.abc import AsyncIterator
from contextlib import closing
from pathlib import Path

import pytest

from app.storage import open_storage
from tests.support.stored_samples import event, plan

INSERT = "INTO events (seq, kind, version, time, data, hash) VALUES ({}, 'run.item', 1, 0, '{{}}', '')"


@pytest.fixture
async def connection(tmp_path: Path) -> AsyncIterator[sqlite3.Connection]:
    path = tmp_path / "journal.db"
    async with open_storage(path) as storage:
        await storage.events.append([event(1), event(2), event(3)])
        await storage.events.append([], plans=[plan()])
    with closing(sqlite3.connect(path)) as connection:
        yield connection


@pytest.mark.parametrize(
    ("statement", "why"),
    [
        ("UPDATE events SET data = '{}' WHERE seq = 2", "events never change"),
        ("UPDATE events SET seq = 9 WHERE seq = 3", "events never change"),
        ("DELETE FROM events WHERE seq = 3", "events are deleted only by retention"),
        ("DELETE FROM events", "events are deleted only by retention"),
        ("INSERT " + INSERT.format(5), "next seq"),
        ("INSERT " + INSERT.format(3), "next seq"),
        ("INSERT " + INSERT.format(0), "next seq"),
        ("REPLACE " + INSERT.format(2), "next seq"),
        ("UPDATE plans SET document = '{}'", "plans never change"),
        ("DELETE FROM plans", "plans are deleted only by retention"),
        ("INSERT INTO gateway (only, id) VALUES (2, 'gw-2')", "one_gateway"),
    ],
)
def test_the_file_refuses(connection: sqlite3.Connection, statement: str, why: str) -> None:
    with pytest.raises(sqlite3.IntegrityError, match=why):
        connection.execute(statement)


def test_the_next_event_is_taken(connection: sqlite3.Connection) -> None:
    connection.execute("INSERT " + INSERT.format(4))
    assert connection.execute("SELECT max(seq) FROM events").fetchone() == (4,)
