"""Plans, runs, jobs and queues as gateways store them, written as they are: the newest version of each counts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import asyncpg
import sqlalchemy as sa
from sqlalchemy.ext.asyncio import AsyncConnection

from app.domain.cluster.envelope import Envelope, Row
from app.domain.errors import ConflictError
from app.domain.jobs.job import Job
from app.domain.jobs.queue import VehicleQueue
from app.domain.ports.stores import ALL_JOBS, JobRecord
from app.domain.run.run import Run
from app.storage.dispatch import TableJobStore, job_row, run_row
from app.storage.postgres.database import DriverStatement, PostgresDatabase, driver_of

_PLAN: Final = DriverStatement(
    sa.text(
        "INSERT INTO plans (id, hash, name, vehicle_type, created_at, created_by, document) "
        "VALUES (:id, :hash, :name, :vehicle_type, :created_at, :created_by, :document) ON CONFLICT (id) DO NOTHING"
    )
)


def _handovers(table: str) -> str:
    """SQL: see Run.handovers."""
    return f"coalesce(({table}.document::json #>> '{{taken_over,number}}')::int, 0)"


RUN_TYPES: Final = {
    "id": "text",
    "plan_id": "text",
    "vehicle_id": "text",
    "is_over": "boolean",
    "state": "text",
    "created_at": "double precision",
    "document": "text",
    "as_of": "bigint",
}
_RUN_COLUMNS: Final = ", ".join(RUN_TYPES)
_RUN_CHANGES: Final = (
    "ON CONFLICT (id) DO UPDATE SET plan_id = excluded.plan_id, vehicle_id = excluded.vehicle_id, "
    "is_over = excluded.is_over, state = excluded.state, document = excluded.document, as_of = excluded.as_of "
    # a gateway that lost the run to another one says nothing of it any more
    f"WHERE ({_handovers('excluded')}, excluded.as_of) >= ({_handovers('runs')}, runs.as_of)"
)
_RUN: Final = DriverStatement(
    sa.text(f"INSERT INTO runs ({_RUN_COLUMNS}) VALUES ({', '.join(f':{name}' for name in RUN_TYPES)}) {_RUN_CHANGES}")
)


def put_runs(rows: str) -> str:
    """SQL: the same for rows of the table `new`, see `unnested`. Of two gateways that tell of one run one counts."""
    return (
        f"INSERT INTO runs ({_RUN_COLUMNS}) SELECT {_RUN_COLUMNS} FROM (SELECT DISTINCT ON (new.id) new.* FROM {rows} "
        f"ORDER BY new.id, {_handovers('new')} DESC, new.as_of DESC, n DESC) AS newest ORDER BY n {_RUN_CHANGES}"
    )


def _fence(table: str) -> str:
    """SQL: see Job.fence."""
    return f"coalesce(({table}.document::json ->> 'fence')::int, 0)"


def _claimant(table: str) -> str:
    """SQL: the gateway of Job.claim, empty without one."""
    return f"coalesce({table}.document::json #>> '{{claim,gateway}}', '')"


_JOB_COLUMNS: Final = ("id", "plan_id", "vehicle_id", "state", "is_over", "document", "site", "as_of")


def _put_job(condition: str, *more: str) -> sa.TextClause:
    """Insert a job, or change it if the condition holds. `more` columns are written, too."""
    columns = (*_JOB_COLUMNS, *more)
    changes = ", ".join(f"{name} = excluded.{name}" for name in columns if name not in ("id", "plan_id"))
    return sa.text(
        f"INSERT INTO jobs ({', '.join(columns)}) VALUES ({', '.join(f':{name}' for name in columns)}) "
        f"ON CONFLICT (id) DO UPDATE SET {changes} WHERE {condition}"
    )


_JOB: Final = DriverStatement(
    _put_job(
        # of one fencing number, only the gateway that the cluster has given the job to says more of it
        f"{_fence('excluded')} > {_fence('jobs')} OR ({_fence('excluded')} = {_fence('jobs')} "
        f"AND {_claimant('excluded')} = {_claimant('jobs')} "
        "AND (excluded.site <> jobs.site OR excluded.as_of >= jobs.as_of))"
    )
)
_OWN_JOB: Final = _put_job(
    # its gateway may have started or ended it since it was read; without a fencing number, a job has one writer
    f"({_fence('excluded')} > {_fence('jobs')} AND jobs.state IN ('queued', 'preparing', 'prepared', 'returned')) "
    f"OR ({_fence('excluded')} = 0 AND {_fence('jobs')} = 0)",
    "own_fence",
)
_AT_NO_GATEWAY: Final = sa.literal_column(
    f"({_fence('jobs')} > 0 AND coalesce(jobs.document::json #>> '{{claim,taken}}', 'false') = 'false')", sa.Boolean
)
RETURNED_AT_ONCE: Final = 100
_GIVEN_BACK: Final = sa.literal_column(
    # not one that a gateway relays again to a store which was restored: others may have got it since
    f"jobs.state = 'returned' AND jobs.own_fence > 0 AND jobs.own_fence = {_fence('jobs')}",
    sa.Boolean,
)
_QUEUE: Final = DriverStatement(
    sa.text(
        "INSERT INTO job_queues (vehicle_id, document, as_of) VALUES (:vehicle_id, :document, :as_of) "
        "ON CONFLICT (vehicle_id) DO UPDATE SET document = excluded.document, as_of = excluded.as_of "
        "WHERE excluded.as_of >= job_queues.as_of"
    )
)


async def store_others(driver: asyncpg.Connection[Any], envelopes: Sequence[Envelope]) -> None:
    """Store the documents of envelopes other than runs. What a newer Waydrop adds to a row is left out."""
    for statement, key, rows in (
        (_PLAN, "id", [one.plans for one in envelopes]),
        (_JOB, "id", [one.jobs for one in envelopes]),
        (_QUEUE, "vehicle_id", [one.queues for one in envelopes]),
    ):
        await statement.execute_many(driver, newest_rows(key, envelopes, rows))


def newest_rows(
    key: str, envelopes: Sequence[Envelope], rows: Sequence[Sequence[Row]]
) -> Sequence[Mapping[str, object]]:
    """Of a gateway's versions of one document the newest. `rows` are those of each envelope."""
    newest: dict[tuple[str, object], tuple[int, Mapping[str, object]]] = {}
    for envelope, of_envelope in zip(envelopes, rows, strict=True):
        for row in of_envelope:
            new = envelope.as_of, {**row, "site": envelope.site, "as_of": envelope.as_of}
            known = newest.pop((envelope.gateway, row[key]), new)  # put back as the last one to be stored
            newest[envelope.gateway, row[key]] = new if known[0] <= new[0] else known
    return [row for _, row in newest.values()]


async def store_own(connection: AsyncConnection, runs: Sequence[Run], records: Sequence[JobRecord], as_of: int) -> None:
    """Store what an API node has changed; of several versions of one the last counts.

    Raises ConflictError: another node has changed a job since it was read.
    """
    jobs = {
        record.id: {**job_row(record), "site": "", "as_of": as_of, "own_fence": record.fence}
        for record in records
        if isinstance(record, Job)
    }
    queues = {
        record.vehicle_id: {"vehicle_id": record.vehicle_id, "document": record.model_dump_json(), "as_of": as_of}
        for record in records
        if isinstance(record, VehicleQueue)
    }
    driver = await driver_of(connection)
    newest = {run.id: {**run_row(run), "as_of": as_of} for run in runs}
    await _RUN.execute_many(driver, list(newest.values()))
    for job in jobs.values():
        stored = await connection.execute(_OWN_JOB, job)
        if stored.rowcount != 1:
            raise ConflictError(f"job {job['id']} was changed by another node meanwhile", hint="read the job again")
    await _QUEUE.execute_many(driver, list(queues.values()))


class PostgresJobStore(TableJobStore):
    """JobStore in PostgreSQL, where jobs have a site."""

    def __init__(self, database: PostgresDatabase) -> None:
        super().__init__(database)
        self._cluster = database

    async def site_of(self, job_id: str) -> str | None:
        """See SitedJobs."""
        jobs = sa.table("jobs", sa.column("id"), sa.column("site"))
        rows = await self._cluster.read(sa.select(jobs.c.site).where(jobs.c.id == job_id))
        return str(rows[0]["site"]) if rows else None


class PostgresSharedJobStore(TableJobStore):
    """SharedJobStore in PostgreSQL."""

    def __init__(self, database: PostgresDatabase) -> None:
        super().__init__(database, _AT_NO_GATEWAY)
        self._given_back = TableJobStore(database, _GIVEN_BACK)

    async def list_queues(self) -> Sequence[VehicleQueue]:
        """Vehicles belong to gateways."""
        return ()

    async def returned(self) -> Sequence[Job]:
        """See SharedJobStore."""
        return await self._given_back.list_jobs(ALL_JOBS, limit=RETURNED_AT_ONCE)
