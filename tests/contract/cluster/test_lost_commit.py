"""The answer to a commit may be lost: then it is not known whether something was stored, and nobody may repeat it."""

from __future__ import annotations

import asyncio
from pathlib import Path

import asyncpg
import pytest
from sqlalchemy.engine import make_url

from app.api.problems import PROBLEMS
from app.domain.errors import StorageError
from app.storage.postgres import open_cluster_storage
from tests.support.cluster_servers import PostgresDatabases
from tests.support.cut_point import cut_point
from tests.support.service_process import until
from tests.support.stored_samples import event

SOON_S = 60.0
HELD_COMMITS = """
CREATE FUNCTION hold() RETURNS trigger LANGUAGE plpgsql AS
    'BEGIN PERFORM pg_advisory_xact_lock(1); RETURN NULL; END';
CREATE CONSTRAINT TRIGGER hold AFTER INSERT ON events DEFERRABLE INITIALLY DEFERRED
    FOR EACH ROW EXECUTE FUNCTION hold();
SELECT pg_advisory_lock(1);
"""
"""A commit waits until the connection that has said this ends."""
COMMITTING = (
    "SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() "
    "AND (wait_event_type, wait_event) = ('Lock', 'advisory')"
)


async def test_what_may_be_stored_is_told_as_unknown_and_nobody_is_asked_to_repeat_it(
    tmp_path: Path, databases: PostgresDatabases
) -> None:
    """A dispatcher repeats what is answered with Retry-After: a job was made twice, and flown twice."""
    url = await asyncio.to_thread(databases.new)
    async with (
        cut_point(make_url(url).port or 0) as point,
        open_cluster_storage(url, key_file=tmp_path / "key") as store,
        open_cluster_storage(
            make_url(url).set(port=point.port).render_as_string(hide_password=False), key_file=tmp_path / "key"
        ) as behind,
    ):
        looking = await asyncpg.connect(url)
        try:
            await looking.execute(HELD_COMMITS)
            storing = asyncio.create_task(behind.events.append([event(1)]))
            await until(lambda: looking.fetchval(COMMITTING), bool, "it must be committing", SOON_S)
            point.drop()
            with pytest.raises(StorageError) as caught:
                await storing
        finally:
            await looking.close()
        await until(store.events.last_seq, lambda position: position == 1, "it is stored all the same", SOON_S)
        problem = PROBLEMS[caught.value.code]
        assert (problem.status, problem.retry_after_s) == (504, None)
