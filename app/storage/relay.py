"""The journal as it is sent to a cluster: rows of events and documents, not parsed; implements RelayLog."""

from __future__ import annotations

import json
import math
import sqlite3
from collections import deque
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any, Final

import sqlalchemy as sa

from app.domain.cluster.envelope import Envelope, RelayedEvent, Row
from app.domain.events import EventKind
from app.domain.events.event import JournalHead
from app.domain.events.service import JournalPruned
from app.domain.run.run import Run
from app.storage.database import Database
from app.storage.dispatch import run_row
from app.storage.schema import EVENTS, JOB_QUEUES, JOBS, PLANS, RUNS

_COLUMNS: Final = tuple(EVENTS.c.keys())
_LAST_SEQ: Final = "SELECT coalesce(max(seq), 0) FROM events"
_NEWEST_PRUNED: Final = "SELECT data FROM events WHERE kind = 'journal.pruned' ORDER BY seq DESC LIMIT 1"
_PAGE: Final = f"SELECT {', '.join(_COLUMNS)} FROM events WHERE seq > ? ORDER BY seq LIMIT ?"

RECENT_COMMITS: Final = 64
RECENT_EVENTS: Final = 64
"""Of one commit: a larger one is read, so that what is kept is a few MB."""
RECENT_RUNS: Final = 1000

PLAN_KEPT_S: Final = 43_200.0
"""So long a cluster keeps a plan that nothing uses, however short its retention is; less, for clocks that differ.
What a gateway sends after an absence may be older than that, whatever the time between a plan and its run.
"""
_OLD_PLANS: Final = """
SELECT plans.id FROM jobs JOIN plans ON plans.id = jobs.plan_id
WHERE jobs.id IN (SELECT value FROM json_each(:jobs))
    AND plans.created_at < max(:before, strftime('%s', 'now') - :kept_s)
UNION SELECT plans.id FROM runs JOIN plans ON plans.id = runs.plan_id
WHERE runs.id IN (SELECT value FROM json_each(:begun))
    AND plans.created_at < max(:before, strftime('%s', 'now') - :kept_s)
    OR runs.id IN (SELECT value FROM json_each(:runs)) AND runs.created_at < :before
"""


class RecentCommits:
    """The newest commits as they were stored: a relay that keeps up does not read what was just written.

    Kept are events that need no documents but their own runs, which a commit has stored or which were relayed before.
    Other commits are read. Until the relay has read once, nothing is kept.
    """

    def __init__(self) -> None:
        self._commits: deque[tuple[Sequence[Mapping[str, Any]], Mapping[str, Run]]] = deque(maxlen=RECENT_COMMITS)
        self._unsent_runs: dict[str, Run] = {}
        self._created_at: dict[str, float] = {}  # of the runs that were sent
        self._pruned_before: float | None = None
        self._pruned_seq = 0

    def know_read(self, envelope: Envelope, pruned_before: float) -> None:
        """This was read. Events before this time (Unix seconds) were deleted."""
        if envelope.as_of >= self._pruned_seq:
            self._pruned_before = pruned_before
        self._know({str(row["id"]): float(row["created_at"] or 0.0) for row in envelope.runs})

    def add(self, rows: Sequence[Mapping[str, Any]], runs: Sequence[Run], *, has_others: bool) -> None:
        """What one commit has stored; `has_others`: also plans, jobs or queues."""
        pruned = [row["seq"] for row in rows if row["kind"] == EventKind.JOURNAL_PRUNED]
        self._pruned_seq = max(pruned, default=self._pruned_seq)  # also before the first read: it may be under way
        if self._pruned_before is None:
            return
        if pruned:
            self._pruned_before = math.inf  # until it is read
        self._unsent_runs |= {run.id: run for run in runs}
        is_kept = not has_others and len(rows) <= RECENT_EVENTS and all(self._needs_no_reading(row) for row in rows)
        # a run waits for an event of its own, as when it is read: another commit may be dropped
        told = {row["run_id"] for row in rows} & self._unsent_runs.keys()
        of_commit = {run_id: self._unsent_runs.pop(run_id) for run_id in told}
        if not is_kept:
            self._commits.clear()
        elif rows:
            if self._commits and self._commits[-1][0][-1]["seq"] + 1 != rows[0]["seq"]:
                self._commits.clear()
            self._commits.append((rows, of_commit))
            self._know({run.id: run.created_at for run in of_commit.values()})

    def after(self, seq: int, limit: int) -> tuple[Sequence[RelayedEvent], Mapping[str, Run]]:
        """Whole commits from the one that follows event `seq`, at most `limit` events; none if it is not kept."""
        events: list[RelayedEvent] = []
        runs: dict[str, Run] = {}
        for rows, of_commit in self._commits:
            if rows[0]["seq"] == seq + len(events) + 1 and len(events) + len(rows) <= limit:
                events += [RelayedEvent.model_validate(row) for row in rows]
                runs |= of_commit
        return events, runs

    def _needs_no_reading(self, row: Mapping[str, Any]) -> bool:
        if row["kind"] in _NEEDS_DOCUMENTS:
            return False
        run = self._unsent_runs.get(row["run_id"])
        created_at = self._created_at.get(row["run_id"]) if run is None else run.created_at
        # with each event of a run from before the deletion goes its plan, see _old_plans
        return row["run_id"] is None or (created_at is not None and created_at >= (self._pruned_before or 0.0))

    def _know(self, created_at: Mapping[str, float]) -> None:
        self._created_at |= created_at
        for run_id in list(self._created_at)[:-RECENT_RUNS]:
            del self._created_at[run_id]


class SqliteRelayLog:
    """RelayLog on one SQLite file. What `recent` has is not read."""

    def __init__(self, database: Database, gateway_id: str, recent: RecentCommits) -> None:
        self._database = database
        self._gateway_id = gateway_id
        self._recent = recent

    async def envelope(self, site: str, *, after: int, limit: int) -> Envelope:
        events, runs = self._recent.after(after, limit)
        if not events:
            return await self._read(site, after=after, limit=limit)
        return Envelope(
            site=site,
            gateway=self._gateway_id,
            as_of=events[-1].seq,
            events=tuple(events),
            runs=tuple([run_row(runs[run_id]) for run_id in sorted(runs)]),
        )

    async def _read(self, site: str, *, after: int, limit: int) -> Envelope:
        def read(connection: sqlite3.Connection) -> tuple[Envelope, JournalPruned | None]:
            pruned = _pruned(connection)
            start = None
            if pruned is not None and after < pruned.up_to:
                start = JournalHead(seq=pruned.up_to, hash=pruned.chains[0].hash)
            page = connection.execute(_PAGE, (after if start is None else start.seq, limit))
            events = [RelayedEvent(**dict(zip(_COLUMNS, row, strict=True))) for row in page]
            naming = [(event.kind, json.loads(event.data)) for event in events if event.kind in _NAMES_DOCUMENTS]
            plans = _named(naming, EventKind.PLAN_CREATED, "plan_id")
            plans |= _named(naming, EventKind.RUN_MISSION_CHANGED, "change", "plan_id")
            jobs = _named(naming, EventKind.JOB_CHANGED, "job", "id")
            queues = _named(naming, EventKind.JOB_QUEUE_CHANGED, "queue", "vehicle_id")
            if start is not None:  # nothing else tells of queues that were stopped before
                queues |= {vehicle_id for (vehicle_id,) in connection.execute("SELECT vehicle_id FROM job_queues")}
            runs = {event.run_id for event in events if event.run_id is not None}
            begun = {event.run_id for event in events if event.kind == EventKind.RUN_CREATED and event.run_id}
            plans |= _old_plans(connection, pruned, jobs=jobs, runs=runs, begun=begun)
            envelope = Envelope(
                site=site,
                gateway=self._gateway_id,
                as_of=connection.execute(_LAST_SEQ).fetchone()[0],
                events=tuple(events),
                plans=_rows(connection, PLANS, "id", plans),
                runs=_rows(connection, RUNS, "id", runs),
                jobs=_rows(connection, JOBS, "id", jobs),
                queues=_rows(connection, JOB_QUEUES, "vehicle_id", queues),
                start=start,
            )
            return envelope, pruned

        envelope, pruned = await self._database.read_at_once(read)
        self._recent.know_read(envelope, 0.0 if pruned is None else pruned.before or 0.0)
        return envelope


def _pruned(connection: sqlite3.Connection) -> JournalPruned | None:
    row = connection.execute(_NEWEST_PRUNED).fetchone()
    return None if row is None else JournalPruned.model_validate_json(row[0])


def _old_plans(connection: sqlite3.Connection, pruned: JournalPruned | None, **of: Collection[str]) -> set[str]:
    """The plans of jobs, of runs that begin, and of those that had begun in deleted events, if the plan's own event
    was deleted here or may have been deleted in the cluster: nothing else tells the cluster of them.
    """
    if not any(of.values()):
        return set()
    ids = {name: json.dumps(list(wanted)) for name, wanted in of.items()}
    before = 0.0 if pruned is None else pruned.before or 0.0
    rows = connection.execute(_OLD_PLANS, {**ids, "before": before, "kept_s": PLAN_KEPT_S})
    return {plan_id for (plan_id,) in rows}


def _rows(connection: sqlite3.Connection, table: sa.Table, key: str, ids: Iterable[str]) -> tuple[Row, ...]:
    wanted = sorted(ids)
    if not wanted:
        return ()
    columns = [column for column in table.c if column.name != "position"]
    names = ", ".join(column.name for column in columns)
    query = f"SELECT {names} FROM {table.name} WHERE {key} IN ({', '.join('?' * len(wanted))})"
    return tuple(
        [
            {
                column.name: bool(value) if isinstance(column.type, sa.Boolean) else value
                for column, value in zip(columns, row, strict=True)
            }
            for row in connection.execute(query, wanted)
        ]
    )


_NAMES_DOCUMENTS = (
    EventKind.PLAN_CREATED,
    EventKind.RUN_MISSION_CHANGED,
    EventKind.JOB_CHANGED,
    EventKind.JOB_QUEUE_CHANGED,
)
_NEEDS_DOCUMENTS: Final = frozenset((*_NAMES_DOCUMENTS, EventKind.RUN_CREATED, EventKind.JOURNAL_PRUNED))


def _named(events: Sequence[tuple[str, Any]], kind: EventKind, *path: str) -> set[str]:
    found = set()
    for of, data in events:
        if of == kind:
            for step in path:
                data = data[step]
            found.add(str(data))
    return found
