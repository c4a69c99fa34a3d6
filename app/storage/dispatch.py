"""Plans, runs and jobs on disk. Each is written in the transaction of its event (events.py)."""

from __future__ import annotations

import sqlite3
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import sqlalchemy as sa
from sqlalchemy.dialects.sqlite import insert

from app.domain.jobs.job import Job
from app.domain.jobs.queue import VehicleQueue
from app.domain.ports.stores import JobFilter, JobRecord, RunFilter, StoredPlan
from app.domain.run.run import Run, RunState
from app.domain.vehicle.state import VehicleType
from app.storage.database import TableAccess, driver_sql, from_json, object_from_json, to_json, unreadable
from app.storage.schema import JOB_QUEUES, JOBS, PLANS, RUNS

INSERT_PLAN = driver_sql(insert(PLANS))


def plan_row(plan: StoredPlan) -> dict[str, Any]:
    """The plan as a row; events.py stores it with its event. Raises InvalidInputError if it is not JSON."""
    document = to_json(f"plan {plan.id}", plan.document)
    return asdict(plan) | {"vehicle_type": plan.vehicle_type.value, "document": document}


class TablePlanStore:
    """PlanStore on SQLite or PostgreSQL."""

    def __init__(self, database: TableAccess) -> None:
        self._database = database

    async def get(self, plan_id: str) -> StoredPlan | None:
        rows = await self._database.read(sa.select(PLANS).where(PLANS.c.id == plan_id))
        return _stored(rows[0]) if rows else None

    async def list_plans(self, *, limit: int, older_than: str | None = None) -> Sequence[StoredPlan]:
        query = sa.select(PLANS).order_by(PLANS.c.position.desc()).limit(limit)
        if older_than is not None:
            query = query.where(_is_older(PLANS, older_than))
        return tuple([_stored(row) for row in await self._database.read(query)])


def _stored(row: sa.RowMapping) -> StoredPlan:
    try:
        return StoredPlan(
            id=row["id"],
            hash=row["hash"],
            name=row["name"],
            vehicle_type=VehicleType(row["vehicle_type"]),
            created_at=row["created_at"],
            created_by=row["created_by"],
            document=object_from_json(f"plan {row['id']}", row["document"]),
        )
    except ValueError as error:
        raise unreadable(f"plan {row['id']}") from error


_INSERT_RUN = insert(RUNS)
_RUN_CHANGES = ("plan_id", "vehicle_id", "is_over", "state", "document")
_UPSERT_RUN = driver_sql(
    _INSERT_RUN.on_conflict_do_update(
        index_elements=["id"], set_={column: _INSERT_RUN.excluded[column] for column in _RUN_CHANGES}
    )
)


def upsert_runs(connection: sqlite3.Connection, runs: Sequence[Run]) -> None:
    """Store each run as it is now; of several versions of one run the last one counts."""
    newest = {run.id: run for run in runs}
    connection.executemany(_UPSERT_RUN, [run_row(run) for run in newest.values()])


def run_row(run: Run) -> dict[str, Any]:
    return {
        "id": run.id,
        "plan_id": run.plan_id,
        "vehicle_id": run.vehicle_id,
        "is_over": run.is_over,
        "state": run.state.value,
        "created_at": run.created_at,
        "document": run.model_dump_json(),
    }


class TableRunStore:
    """RunStore on SQLite or PostgreSQL."""

    def __init__(self, database: TableAccess) -> None:
        self._database = database

    async def get(self, run_id: str) -> Run | None:
        query = sa.select(RUNS.c.id, RUNS.c.document).where(RUNS.c.id == run_id)
        rows = await self._database.read(query)
        return _run(rows[0]) if rows else None

    async def list_runs(self, wanted: RunFilter, *, limit: int) -> Sequence[Run]:
        query = sa.select(RUNS.c.id, RUNS.c.document).order_by(RUNS.c.position.desc()).limit(limit)
        query = query.where(*_conditions(RUNS, wanted))
        if wanted.created_from is not None:
            query = query.where(*_stored_between(RUNS.c.created_at >= wanted.created_from))
        if wanted.created_before is not None:
            query = query.where(*_stored_between(RUNS.c.created_at < wanted.created_before))
        rows = await self._database.read(query)
        return tuple([_run(row) for row in rows])

    async def open_states(self) -> Mapping[RunState, int]:
        rows = await self._database.read(sa.select(RUNS.c.state).where(~RUNS.c.is_over))  # GROUP BY would read all
        return Counter(RunState(row["state"]) for row in rows)


def _stored_between(is_wanted: sa.ColumnElement[bool]) -> Iterator[sa.ColumnElement[bool]]:
    """A condition on times, and the positions that it leaves, from the index alone: a clock may have jumped."""
    position = RUNS.c.position + 0  # without it SQLite goes through the table from an end
    first, last = sa.func.min(position), sa.func.max(position)
    yield RUNS.c.position >= sa.select(first).where(is_wanted).scalar_subquery()
    yield RUNS.c.position <= sa.select(last).where(is_wanted).scalar_subquery()
    yield is_wanted


def _conditions(table: sa.Table, wanted: RunFilter | JobFilter) -> Iterator[sa.ColumnElement[bool]]:
    """What both filters have, for the rows of runs or jobs."""
    if wanted.vehicle_id is not None:
        yield table.c.vehicle_id == wanted.vehicle_id
    if wanted.plan_id is not None:
        yield table.c.plan_id == wanted.plan_id
    if wanted.open_only:
        yield ~table.c.is_over  # `is_over = 0`: for `IS 0` SQLite does not use the index of open runs or jobs
    if wanted.states:
        yield table.c.state.in_(sorted(state.value for state in wanted.states))
    if wanted.older_than is not None:
        yield _is_older(table, wanted.older_than)


def _is_older(table: sa.Table, row_id: str) -> sa.ColumnElement[bool]:
    """Rows that were stored before one; none if it is unknown."""
    last = sa.select(table.c.position).where(table.c.id == row_id).scalar_subquery()
    return table.c.position < last


def _run(row: sa.RowMapping) -> Run:
    return from_json(Run, f"run {row['id']}", row["document"])


_INSERT_JOB = insert(JOBS)
_JOB_CHANGES = ("vehicle_id", "state", "is_over", "document")
_UPSERT_JOB = driver_sql(
    _INSERT_JOB.on_conflict_do_update(
        index_elements=["id"], set_={column: _INSERT_JOB.excluded[column] for column in _JOB_CHANGES}
    )
)
_INSERT_QUEUE = insert(JOB_QUEUES)
_UPSERT_QUEUE = driver_sql(
    _INSERT_QUEUE.on_conflict_do_update(
        index_elements=["vehicle_id"], set_={"document": _INSERT_QUEUE.excluded.document}
    )
)


def upsert_jobs(connection: sqlite3.Connection, records: Sequence[JobRecord]) -> None:
    """Store each as it is now; of several versions of one the last counts."""
    jobs = {record.id: record for record in records if isinstance(record, Job)}
    queues = {record.vehicle_id: record for record in records if isinstance(record, VehicleQueue)}
    connection.executemany(_UPSERT_JOB, [job_row(job) for job in jobs.values()])
    rows = [{"vehicle_id": one.vehicle_id, "document": one.model_dump_json()} for one in queues.values()]
    connection.executemany(_UPSERT_QUEUE, rows)


def job_row(job: Job) -> dict[str, object]:
    named = None if job.selector.is_any else job.selector.vehicle
    return {
        "id": job.id,
        "plan_id": job.plan_id,
        "vehicle_id": job.vehicle_id or named,
        "state": job.state.value,
        "is_over": job.is_over,
        "document": job.model_dump_json(),
    }


class TableJobStore:
    """JobStore on SQLite or PostgreSQL. `only`: further conditions of all lists."""

    def __init__(self, database: TableAccess, *only: sa.ColumnElement[bool]) -> None:
        self._database = database
        self._only = only

    async def get(self, job_id: str) -> Job | None:
        query = sa.select(JOBS.c.id, JOBS.c.document).where(JOBS.c.id == job_id)
        rows = await self._database.read(query)
        return _job(rows[0]) if rows else None

    async def list_jobs(self, wanted: JobFilter, *, limit: int) -> Sequence[Job]:
        query = sa.select(JOBS.c.id, JOBS.c.document).order_by(JOBS.c.position.desc()).limit(limit)
        rows = await self._database.read(query.where(*_conditions(JOBS, wanted), *self._only))
        return tuple([_job(row) for row in rows])

    async def list_queues(self) -> Sequence[VehicleQueue]:
        rows = await self._database.read(sa.select(JOB_QUEUES).order_by(JOB_QUEUES.c.vehicle_id))
        return tuple([from_json(VehicleQueue, f"the queue of {row['vehicle_id']}", row["document"]) for row in rows])


def _job(row: sa.RowMapping) -> Job:
    return from_json(Job, f"job {row['id']}", row["document"])
