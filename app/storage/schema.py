"""The tables, as code reads and writes them. A new journal gets these, an older one what migrations/ make; a test holds
the two equal.

Documents (a run, a plan, an event's data) are JSON text; columns beside them exist only to be searched.
`position` is the order of insertion: "newest first" must not depend on a clock that jumps.
"""

from __future__ import annotations

import sqlalchemy as sa

METADATA = sa.MetaData()

REVISION = "journal_5"
"""The newest step of migrations/versions: a journal at it has these tables."""

OFFBOARD_KINDS = sa.text("(kind = 'offboard.lease' OR kind = 'offboard.changed' OR kind = 'task.changed')")
"""Events of offboard control. SQLite uses their index only for a query with this very text. With `kind IN (...)` it
fills a temporary table with the three for each event that it stores.
"""

ACCEPTED_KIND = sa.text("kind = 'request.accepted'")
"""Events of the audit log; the same applies to their index."""

PRUNED_KIND = sa.text("kind = 'journal.pruned'")
"""What was deleted by age; the same applies to their index."""

GATEWAY = sa.Table(
    "gateway",
    METADATA,
    sa.Column("only", sa.Integer, primary_key=True),
    sa.Column("id", sa.Text, nullable=False),
    sa.CheckConstraint("only = 1", name="one_gateway"),
)
"""The gateway that numbers the events of this journal: one row."""

EVENTS = sa.Table(
    "events",
    METADATA,
    sa.Column("seq", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("kind", sa.Text, nullable=False),
    sa.Column("version", sa.Integer, nullable=False),
    sa.Column("time", sa.Double, nullable=False),
    sa.Column("vehicle_id", sa.Text),
    sa.Column("run_id", sa.Text),
    sa.Column("data", sa.Text, nullable=False),
    sa.Column("hash", sa.Text, nullable=False),
    sa.Index("ix_events_run_id_seq", "run_id", "seq", sqlite_where=sa.text("run_id IS NOT NULL")),
    sa.Index("ix_events_accepted", "seq", sqlite_where=ACCEPTED_KIND),
    sa.Index("ix_events_pruned", "seq", sqlite_where=PRUNED_KIND),
    sa.Index("ix_events_offboard", "kind", "vehicle_id", "seq", sqlite_where=OFFBOARD_KINDS),
)
"""Triggers refuse a change, a seq that is not the next one, and a deletion of what no journal.pruned event names.
`hash` chains the rows (domain/events/event.py); storage/verify.py checks it.
"""

PLANS = sa.Table(
    "plans",
    METADATA,
    sa.Column("position", sa.Integer, primary_key=True),
    sa.Column("id", sa.Text, nullable=False, unique=True),
    sa.Column("hash", sa.Text, nullable=False),
    sa.Column("name", sa.Text, nullable=False),
    sa.Column("vehicle_type", sa.Text, nullable=False),
    sa.Column("created_at", sa.Double, nullable=False),
    sa.Column("created_by", sa.Text, nullable=False),
    sa.Column("document", sa.Text, nullable=False),
)
"""Triggers refuse a change, and a deletion before its time: a run's evidence names the plan that it flew."""

RUNS = sa.Table(
    "runs",
    METADATA,
    sa.Column("position", sa.Integer, primary_key=True),
    sa.Column("id", sa.Text, nullable=False, unique=True),
    sa.Column("plan_id", sa.Text, sa.ForeignKey("plans.id"), nullable=False),
    sa.Column("vehicle_id", sa.Text, nullable=False),
    sa.Column("is_over", sa.Boolean, nullable=False),
    sa.Column("document", sa.Text, nullable=False),
    sa.Column("state", sa.Text, nullable=False),
    sa.Column("created_at", sa.Double, nullable=False),
    sa.Index("ix_runs_vehicle_id_position", "vehicle_id", "position"),
    sa.Index("ix_runs_plan_id_position", "plan_id", "position"),
    sa.Index("ix_runs_state_position", "state", "position"),
    sa.Index("ix_runs_created_at_position", "created_at", "position"),
    sa.Index("ix_runs_open", "position", sqlite_where=sa.text("is_over = 0")),
)

TOKENS = sa.Table(
    "tokens",
    METADATA,
    sa.Column("position", sa.Integer, primary_key=True),
    sa.Column("id", sa.Text, nullable=False, unique=True),
    sa.Column("name", sa.Text, nullable=False),
    sa.Column("role", sa.Text, nullable=False),
    sa.Column("token_hash", sa.Text, nullable=False, unique=True),
    sa.Column("created_at", sa.Double, nullable=False),
    sa.Column("revoked_at", sa.Double),
    sa.Column("expires_at", sa.Double),
    sa.Column("last_used_at", sa.Double),
    sa.Index("ix_tokens_live_name", "name", unique=True, sqlite_where=sa.text("revoked_at IS NULL")),
)

REFUSALS = sa.Table(
    "refusals",
    METADATA,
    sa.Column("position", sa.Integer, primary_key=True),
    sa.Column("time", sa.Double, nullable=False),
    sa.Column("actor", sa.Text, nullable=False),
    sa.Column("token_id", sa.Text, nullable=False),
    sa.Column("address", sa.Text, nullable=False),
    sa.Column("action", sa.Text, nullable=False),
    sa.Column("target", sa.Text, nullable=False),
    sa.Column("status", sa.Integer, nullable=False),
    sa.Column("code", sa.Text, nullable=False),
    sa.Column("count", sa.Integer, nullable=False),
)
"""Rejected requests, for the audit. Only the newest are kept, and no chain covers them: strangers cause them."""

ANSWERS = sa.Table(
    "answers",
    METADATA,
    sa.Column("key", sa.Text, primary_key=True),
    sa.Column("request_hash", sa.Text, nullable=False),
    sa.Column("status", sa.Integer, nullable=False),
    sa.Column("headers", sa.Text, nullable=False),
    sa.Column("body", sa.LargeBinary, nullable=False),
    sa.Column("stored_at", sa.Double, nullable=False),
    sa.Index("ix_answers_stored_at", "stored_at"),
)

FLIGHT_INPUTS = sa.Table(
    "flight_inputs",
    METADATA,
    sa.Column("position", sa.Integer, primary_key=True),
    sa.Column("run_id", sa.Text, nullable=False),
    sa.Column("part", sa.LargeBinary, nullable=False),
    sa.Index("ix_flight_inputs_run_id_position", "run_id", "position"),
)
"""What `waydrop replay` feeds a flight with: packed lines, of the newest runs alone."""

JOBS = sa.Table(
    "jobs",
    METADATA,
    sa.Column("position", sa.Integer, primary_key=True),
    sa.Column("id", sa.Text, nullable=False, unique=True),
    sa.Column("plan_id", sa.Text, sa.ForeignKey("plans.id"), nullable=False),
    sa.Column("vehicle_id", sa.Text),
    sa.Column("state", sa.Text, nullable=False),
    sa.Column("is_over", sa.Boolean, nullable=False),
    sa.Column("document", sa.Text, nullable=False),
    sa.Index("ix_jobs_vehicle_id_position", "vehicle_id", "position"),
    sa.Index("ix_jobs_plan_id_position", "plan_id", "position"),
    sa.Index("ix_jobs_state_position", "state", "position"),
    sa.Index("ix_jobs_open", "position", sqlite_where=sa.text("is_over = 0")),
)
"""`vehicle_id` is the assigned vehicle, else the one that the job names; none if any vehicle may take it."""

JOB_QUEUES = sa.Table(
    "job_queues",
    METADATA,
    sa.Column("vehicle_id", sa.Text, primary_key=True),
    sa.Column("document", sa.Text, nullable=False),
)

WEBHOOKS = sa.Table(
    "webhooks",
    METADATA,
    sa.Column("position", sa.Integer, primary_key=True),
    sa.Column("id", sa.Text, nullable=False, unique=True),
    sa.Column("secret", sa.Text, nullable=False),
    sa.Column("document", sa.Text, nullable=False),
    sa.Column("progress", sa.Text, nullable=False),
)
"""`document` is what an administrator set, `progress` how far it has come: two writers, two columns. The secret signs
messages, so it is kept as it is.
"""

# REPLACE deletes a row without firing a trigger for deletion; the check of the next seq stops that as well
_PRUNED = "(SELECT json_extract(data, '$.{}') FROM events WHERE kind = 'journal.pruned' ORDER BY seq DESC LIMIT 1)"
_TRIGGERS = (
    """CREATE TRIGGER events_are_gapless BEFORE INSERT ON events
    WHEN NEW.seq IS NOT (SELECT coalesce(max(seq), 0) + 1 FROM events)
    BEGIN SELECT RAISE(ABORT, 'an event must have the next seq'); END""",
    """CREATE TRIGGER events_never_change BEFORE UPDATE ON events
    BEGIN SELECT RAISE(ABORT, 'events never change'); END""",
    f"""CREATE TRIGGER events_go_by_age BEFORE DELETE ON events
    WHEN OLD.seq > coalesce({_PRUNED.format("up_to")}, 0)
    BEGIN SELECT RAISE(ABORT, 'events are deleted only by retention'); END""",
    """CREATE TRIGGER plans_never_change BEFORE UPDATE ON plans
    BEGIN SELECT RAISE(ABORT, 'plans never change'); END""",
    f"""CREATE TRIGGER plans_go_by_age BEFORE DELETE ON plans
    WHEN OLD.created_at >= coalesce({_PRUNED.format("before")}, OLD.created_at)
    BEGIN SELECT RAISE(ABORT, 'plans are deleted only by retention'); END""",
)


def make_tables(connection: sa.Connection) -> None:
    """Make all of them in an empty journal."""
    METADATA.create_all(connection)
    for trigger in _TRIGGERS:
        connection.exec_driver_sql(trigger)
