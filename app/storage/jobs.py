"""Jobs and the queues of vehicles on disk; implements JobStore. They are written with their events (events.py)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import sqlalchemy as sa
from sqlalchemy.dialects.sqlite import insert
from sqlalchemy.ext.asyncio import AsyncConnection

from app.domain.jobs.job import Job
from app.domain.jobs.port import JobFilter, JobRecord
from app.domain.jobs.vehicle_queue import VehicleQueue
from app.storage.database import Database
from app.storage.documents import from_json
from app.storage.schema import JOB_QUEUES, JOBS

_INSERT = insert(JOBS)
_UPSERT = _INSERT.on_conflict_do_update(
    index_elements=["id"],
    set_={column: _INSERT.excluded[column] for column in ("vehicle_id", "state", "is_over", "document")},
)
_INSERT_QUEUE = insert(JOB_QUEUES)
_UPSERT_QUEUE = _INSERT_QUEUE.on_conflict_do_update(
    index_elements=["vehicle_id"], set_={"document": _INSERT_QUEUE.excluded.document}
)


async def upsert_jobs(connection: AsyncConnection, records: Sequence[JobRecord]) -> None:
    """Store each as it is now; of several versions of one the last counts."""
    jobs = {record.id: record for record in records if isinstance(record, Job)}
    queues = {record.vehicle_id: record for record in records if isinstance(record, VehicleQueue)}
    if jobs:
        await connection.execute(_UPSERT, [job_row(job) for job in jobs.values()])
    if queues:
        rows = [{"vehicle_id": one.vehicle_id, "document": one.model_dump_json()} for one in queues.values()]
        await connection.execute(_UPSERT_QUEUE, rows)


def job_row(job: Job) -> dict[str, object]:
    """The columns of a job."""
    named = None if job.wish.is_any else job.wish.vehicle
    return {
        "id": job.id,
        "plan_id": job.plan_id,
        "vehicle_id": job.vehicle_id or named,
        "state": job.state.value,
        "is_over": job.is_over,
        "document": job.model_dump_json(),
    }


class SqliteJobStore:
    """JobStore on one SQLite file."""

    def __init__(self, database: Database) -> None:
        self._database = database

    async def get(self, job_id: str) -> Job | None:
        """See JobStore."""
        query = sa.select(JOBS.c.id, JOBS.c.document).where(JOBS.c.id == job_id)
        rows = await self._database.read(query)
        return _job(rows[0]) if rows else None

    async def list_jobs(self, wanted: JobFilter, *, limit: int) -> Sequence[Job]:
        """See JobStore."""
        query = sa.select(JOBS.c.id, JOBS.c.document).order_by(JOBS.c.position.desc()).limit(limit)
        rows = await self._database.read(query.where(*_conditions(wanted)))
        return tuple([_job(row) for row in rows])

    async def list_queues(self) -> Sequence[VehicleQueue]:
        """See JobStore."""
        rows = await self._database.read(sa.select(JOB_QUEUES).order_by(JOB_QUEUES.c.vehicle_id))
        return tuple([from_json(VehicleQueue, f"the queue of {row['vehicle_id']}", row["document"]) for row in rows])


def _conditions(wanted: JobFilter) -> Iterator[sa.ColumnElement[bool]]:
    if wanted.vehicle_id is not None:
        yield JOBS.c.vehicle_id == wanted.vehicle_id
    if wanted.plan_id is not None:
        yield JOBS.c.plan_id == wanted.plan_id
    if wanted.open_only:
        yield JOBS.c.is_over.is_(False)
    if wanted.states:
        yield JOBS.c.state.in_(sorted(state.value for state in wanted.states))
    if wanted.older_than is not None:
        last = sa.select(JOBS.c.position).where(JOBS.c.id == wanted.older_than).scalar_subquery()
        yield JOBS.c.position < last


def _job(row: sa.RowMapping) -> Job:
    return from_json(Job, f"job {row['id']}", row["document"])
