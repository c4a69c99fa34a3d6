"""The journal: events, plans, runs, jobs, webhooks, tokens, answers."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "journal_1"
down_revision = None
branch_labels = None
depends_on = None

_OFFBOARD_KINDS = "kind IN ('offboard.lease', 'offboard.changed', 'task.changed')"
# REPLACE deletes a row without firing a trigger for deletion; the check of the next seq stops that as well
_TRIGGERS = (
    """CREATE TRIGGER events_are_gapless BEFORE INSERT ON events
    WHEN NEW.seq IS NOT (SELECT coalesce(max(seq), 0) + 1 FROM events)
    BEGIN SELECT RAISE(ABORT, 'an event must have the next seq'); END""",
    """CREATE TRIGGER events_never_change BEFORE UPDATE ON events
    BEGIN SELECT RAISE(ABORT, 'events never change'); END""",
    """CREATE TRIGGER events_never_go BEFORE DELETE ON events
    BEGIN SELECT RAISE(ABORT, 'events are never deleted'); END""",
    """CREATE TRIGGER plans_never_change BEFORE UPDATE ON plans
    BEGIN SELECT RAISE(ABORT, 'plans never change'); END""",
    """CREATE TRIGGER plans_never_go BEFORE DELETE ON plans
    BEGIN SELECT RAISE(ABORT, 'plans are never deleted'); END""",
)


def upgrade() -> None:
    """Make all tables of an empty journal."""
    _events()
    _plans_and_runs()
    _jobs()
    _access()
    for trigger in _TRIGGERS:
        op.execute(trigger)


def _events() -> None:
    op.create_table(
        "gateway",
        sa.Column("only", sa.Integer, primary_key=True),
        sa.Column("id", sa.Text, nullable=False),
        sa.CheckConstraint("only = 1", name="one_gateway"),
    )
    op.create_table(
        "events",
        sa.Column("seq", sa.Integer, primary_key=True, autoincrement=False),
        sa.Column("kind", sa.Text, nullable=False),
        sa.Column("version", sa.Integer, nullable=False),
        sa.Column("time", sa.Double, nullable=False),
        sa.Column("vehicle_id", sa.Text),
        sa.Column("run_id", sa.Text),
        sa.Column("data", sa.Text, nullable=False),
        sa.Column("hash", sa.Text, nullable=False),
    )
    op.create_index("ix_events_run_id_seq", "events", ["run_id", "seq"], sqlite_where=sa.text("run_id IS NOT NULL"))
    op.create_index(
        "ix_events_offboard", "events", ["kind", "vehicle_id", "seq"], sqlite_where=sa.text(_OFFBOARD_KINDS)
    )


def _plans_and_runs() -> None:
    op.create_table(
        "plans",
        sa.Column("position", sa.Integer, primary_key=True),
        sa.Column("id", sa.Text, nullable=False, unique=True),
        sa.Column("hash", sa.Text, nullable=False),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("vehicle_type", sa.Text, nullable=False),
        sa.Column("created_at", sa.Double, nullable=False),
        sa.Column("created_by", sa.Text, nullable=False),
        sa.Column("document", sa.Text, nullable=False),
    )
    op.create_table(
        "runs",
        sa.Column("position", sa.Integer, primary_key=True),
        sa.Column("id", sa.Text, nullable=False, unique=True),
        sa.Column("plan_id", sa.Text, sa.ForeignKey("plans.id"), nullable=False),
        sa.Column("vehicle_id", sa.Text, nullable=False),
        sa.Column("is_over", sa.Boolean, nullable=False),
        sa.Column("document", sa.Text, nullable=False),
        sa.Column("state", sa.Text, nullable=False),
        sa.Column("created_at", sa.Double, nullable=False),
    )
    op.create_table(
        "flight_inputs",
        sa.Column("position", sa.Integer, primary_key=True),
        sa.Column("run_id", sa.Text, nullable=False),
        sa.Column("part", sa.LargeBinary, nullable=False),
    )
    op.create_index("ix_flight_inputs_run_id_position", "flight_inputs", ["run_id", "position"])
    op.create_index("ix_runs_vehicle_id_position", "runs", ["vehicle_id", "position"])
    op.create_index("ix_runs_plan_id_position", "runs", ["plan_id", "position"])
    op.create_index("ix_runs_state_position", "runs", ["state", "position"])
    op.create_index("ix_runs_open", "runs", ["position"], sqlite_where=sa.text("is_over = 0"))


def _jobs() -> None:
    op.create_table(
        "jobs",
        sa.Column("position", sa.Integer, primary_key=True),
        sa.Column("id", sa.Text, nullable=False, unique=True),
        sa.Column("plan_id", sa.Text, sa.ForeignKey("plans.id"), nullable=False),
        sa.Column("vehicle_id", sa.Text),
        sa.Column("state", sa.Text, nullable=False),
        sa.Column("is_over", sa.Boolean, nullable=False),
        sa.Column("document", sa.Text, nullable=False),
    )
    op.create_index("ix_jobs_vehicle_id_position", "jobs", ["vehicle_id", "position"])
    op.create_index("ix_jobs_state_position", "jobs", ["state", "position"])
    op.create_index("ix_jobs_open", "jobs", ["position"], sqlite_where=sa.text("is_over = 0"))
    op.create_table(
        "job_queues",
        sa.Column("vehicle_id", sa.Text, primary_key=True),
        sa.Column("document", sa.Text, nullable=False),
    )


def _access() -> None:
    op.create_table(
        "tokens",
        sa.Column("position", sa.Integer, primary_key=True),
        sa.Column("id", sa.Text, nullable=False, unique=True),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("role", sa.Text, nullable=False),
        sa.Column("token_hash", sa.Text, nullable=False, unique=True),
        sa.Column("created_at", sa.Double, nullable=False),
        sa.Column("revoked_at", sa.Double),
    )
    op.create_table(
        "answers",
        sa.Column("key", sa.Text, primary_key=True),
        sa.Column("request_hash", sa.Text, nullable=False),
        sa.Column("status", sa.Integer, nullable=False),
        sa.Column("headers", sa.Text, nullable=False),
        sa.Column("body", sa.LargeBinary, nullable=False),
        sa.Column("stored_at", sa.Double, nullable=False),
    )
    op.create_index("ix_answers_stored_at", "answers", ["stored_at"])
    op.create_table(
        "webhooks",
        sa.Column("position", sa.Integer, primary_key=True),
        sa.Column("id", sa.Text, nullable=False, unique=True),
        sa.Column("secret", sa.Text, nullable=False),
        sa.Column("document", sa.Text, nullable=False),
        sa.Column("progress", sa.Text, nullable=False),
    )
