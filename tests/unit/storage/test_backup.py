"""The backup that the documentation tells to make ends while events are recorded, and is a journal."""

from __future__ import annotations

import asyncio
import re
import sqlite3
from contextlib import closing
from pathlib import Path

from app.storage import open_storage, verify_journal
from tests.support.paths import ROOT
from tests.support.stored_samples import event
from tests.support.verified_journal import write_journal


def documented() -> str:
    """What sqlite3 is told to do."""
    told = re.findall(
        r"""umask 077; sqlite3 waydrop\.db "(.+ 'copy\.db')\"""", (ROOT / "docs/how-to/deploy.md").read_text()
    )
    assert len(told) == 1
    return str(told[0])


def back_up(journal: Path, copy: Path) -> None:
    with closing(sqlite3.connect(journal, isolation_level=None)) as connection:
        connection.execute(documented().replace("copy.db", str(copy)))


async def test_the_documented_backup_ends_while_events_are_recorded_and_can_be_restored(tmp_path: Path) -> None:
    journal, restored = tmp_path / "waydrop.db", tmp_path / "restored" / "waydrop.db"
    restored.parent.mkdir()
    await write_journal(journal)
    async with open_storage(journal) as storage:
        await storage.events.append([event(n, item_id="x" * 1000) for n in range(5000)])
        gateway, stored = storage.gateway_id, await storage.events.last_seq()
        async with asyncio.timeout(60.0):
            backup = asyncio.create_task(asyncio.to_thread(back_up, journal, restored))
            while not backup.done():
                await storage.events.append([event(1)])
            await backup
        assert await storage.events.last_seq() > stored, "it was recorded meanwhile"
    found = await verify_journal(restored)
    assert (found.journal, found.alterations, found.plans, found.runs) == (gateway, [], 1, 1)
    async with open_storage(restored) as storage:
        assert (storage.gateway_id, await storage.events.last_seq()) == (gateway, found.events)
        assert found.events >= stored
