"""`verify-journal` on a cluster's store shows whatever was altered behind Waydrop's back, and nothing else."""

from __future__ import annotations

import asyncio
import hashlib
from pathlib import Path

import asyncpg
import pytest
from typer.testing import CliRunner

from app.cli.main import app
from app.domain.cluster.envelope import new_events
from app.domain.errors import StorageError
from app.domain.events import NewEvent
from app.domain.events.event import JournalHead
from app.domain.events.run import RunAttachment
from app.domain.run.attachment import Attachment
from app.storage import open_storage
from app.storage.postgres import open_cluster_storage, verify, verify_cluster
from tests.support.cluster_servers import PostgresDatabases
from tests.support.verified_journal import write_journal

PHOTO = b"\xff\xd8\xff\xe0 a photo"

_AT = (
    "INSERT INTO events SELECT {position}, gateway, {seq}, kind, version, time, vehicle_id, run_id, data, hash "
    "FROM events WHERE position = 1"
)


@pytest.fixture
async def url(tmp_path: Path, databases: PostgresDatabases, monkeypatch: pytest.MonkeyPatch) -> str:
    """A store with the six events of a gateway, and a file that was attached to its run through an API node."""
    monkeypatch.setattr(verify, "LOOK_AGAIN_S", 0.0)
    url = await asyncio.to_thread(databases.with_tables)
    await write_journal(tmp_path / "journal.db")
    async with (
        open_storage(tmp_path / "journal.db") as gateway,
        open_cluster_storage(url, key_file=tmp_path / "key") as cluster,
    ):
        envelope = await gateway.relay_log.envelope("north", after=0, limit=100)
        async with cluster.projection.leading() as writer:
            await writer.append([(envelope, new_events(JournalHead(), envelope))])
        sha256 = hashlib.sha256(PHOTO).hexdigest()
        await cluster.attachments.put(sha256, PHOTO)
        attached = Attachment(
            plan_item_id="drop-1",
            name="door.jpg",
            media_type="image/jpeg",
            size_bytes=len(PHOTO),
            sha256=sha256,
            at=2001.0,
            actor="a pilot",
        )
        await cluster.events.append([NewEvent.of(RunAttachment(attached), 2001.0, run_id="run-1")])
    return url


async def test_a_store_as_written_is_found_so_with_the_head_of_each_chain(url: str) -> None:
    found = await verify_cluster(url)
    assert found.alterations == []
    assert (found.plans, found.runs, found.attachments) == (1, 1, 1)
    assert {name.partition("-")[0]: head.seq for name, head in found.heads.items()} == {"gw": 6, "cluster": 1}
    kept = list(found.heads.values())
    assert (await verify_cluster(url, kept)).alterations == []
    lost = JournalHead(seq=7, hash="ab" * 32)
    assert (await verify_cluster(url, [lost])).alterations == [
        "event 7 existed and is missing: no gateway has its hash"
    ]


@pytest.mark.parametrize(
    ("statement", "said"),
    [
        ("UPDATE events SET data = replace(data, '2', '3') WHERE seq = 2", ": event 2: its hash is wrong"),
        ("DELETE FROM events WHERE seq = 2", ": event 3: it does not follow event 1"),
        ("DELETE FROM events WHERE position = 3", "position 4: it does not follow position 2"),
        ("DELETE FROM events WHERE position = 7", "events existed up to position 7 and are missing"),
        ("DELETE FROM events WHERE position >= 6", ": event 6 existed and is missing"),
        (_AT.format(position=8, seq=0), ": event 0: no journal has such a number"),
        (_AT.format(position=0, seq=9), "position 0: no stream has such a number"),
        ("UPDATE plans SET document = '{}'", "plan plan-1 differs from the created one"),
        ("UPDATE runs SET document = replace(document, 'released', 'kept')", "run run-1 differs from its events"),
        ("UPDATE runs SET state = 'lost'", "run run-1 differs from its events: state"),
        ("UPDATE attachments SET content = 'another'", "is missing or differs from the attached file"),
        ("DELETE FROM attachments", "is missing or differs from the attached file"),
    ],
)
async def test_what_is_altered_or_taken_out_is_found(url: str, statement: str, said: str) -> None:
    connection = await asyncpg.connect(url)
    try:
        await connection.execute("SET session_replication_role = replica")  # without the triggers that forbid it
        await connection.execute(statement)
    finally:
        await connection.close()
    assert any(said in line for line in (await verify_cluster(url)).alterations)


async def test_the_command_verifies_the_store_of_an_api_node(url: str, tmp_path: Path) -> None:
    environment = {"WAYDROP_POSTGRES_URL": url, "WAYDROP_DATA_DIR": str(tmp_path)}
    result = await asyncio.to_thread(CliRunner().invoke, app, ["verify-journal"], env=environment)
    assert result.exit_code == 0, result.output
    assert "7 events, 1 plan, 1 run, 1 attachment: as written" in result.stderr
    heads = (await verify_cluster(url)).heads
    assert result.stdout.split("\n")[:2] == [f"{head.seq}:{head.hash} {name}" for name, head in sorted(heads.items())]


async def test_a_store_without_tables_cannot_be_verified(databases: PostgresDatabases) -> None:
    url = await asyncio.to_thread(databases.new)
    with pytest.raises(StorageError, match="does not exist"):
        await verify_cluster(url)
