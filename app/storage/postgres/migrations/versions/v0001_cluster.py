"""The cluster: events of all gateways in one order, and what single Waydrops keep in their journals."""

from __future__ import annotations

import secrets

from alembic import op

revision = "cluster_1"
down_revision = None
branch_labels = None
depends_on = None

_TABLES = (
    # the row is locked by whoever appends events: positions are committed in their order
    """CREATE TABLE stream (
        one boolean PRIMARY KEY DEFAULT true CHECK (one), id text NOT NULL, position bigint NOT NULL DEFAULT 0)""",
    "CREATE TABLE gateways (id text PRIMARY KEY, site text NOT NULL, seq bigint NOT NULL, hash text NOT NULL)",
    """CREATE TABLE events (
        position bigint PRIMARY KEY, gateway text NOT NULL, seq bigint NOT NULL, kind text NOT NULL,
        version integer NOT NULL, time double precision NOT NULL, vehicle_id text, run_id text, data text NOT NULL,
        hash text NOT NULL, UNIQUE (gateway, seq))""",
    "CREATE INDEX ix_events_run_id ON events (run_id, position) WHERE run_id IS NOT NULL",
    "CREATE INDEX ix_events_accepted ON events (position) WHERE kind = 'request.accepted'",
    """CREATE INDEX ix_events_offboard ON events (kind, vehicle_id, position)
        WHERE kind IN ('offboard.lease', 'offboard.changed', 'task.changed')""",
    """CREATE TABLE plans (
        position bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY, id text NOT NULL UNIQUE, hash text NOT NULL,
        name text NOT NULL, vehicle_type text NOT NULL, created_at double precision NOT NULL,
        created_by text NOT NULL, document text NOT NULL)""",
    """CREATE TABLE runs (
        position bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY, id text NOT NULL UNIQUE, plan_id text NOT NULL,
        vehicle_id text NOT NULL, is_over boolean NOT NULL, state text NOT NULL,
        created_at double precision NOT NULL, document text NOT NULL, as_of bigint NOT NULL)""",
    "CREATE INDEX ix_runs_vehicle_id ON runs (vehicle_id, position)",
    "CREATE INDEX ix_runs_plan_id ON runs (plan_id, position)",
    "CREATE INDEX ix_runs_state ON runs (state, position)",
    "CREATE INDEX ix_runs_open ON runs (position) WHERE NOT is_over",
    """CREATE TABLE jobs (
        position bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY, id text NOT NULL UNIQUE, plan_id text NOT NULL,
        vehicle_id text, state text NOT NULL, is_over boolean NOT NULL, document text NOT NULL,
        site text NOT NULL, as_of bigint NOT NULL)""",
    "CREATE INDEX ix_jobs_vehicle_id ON jobs (vehicle_id, position)",
    "CREATE INDEX ix_jobs_state ON jobs (state, position)",
    "CREATE INDEX ix_jobs_open ON jobs (position) WHERE NOT is_over",
    "CREATE TABLE job_queues (vehicle_id text PRIMARY KEY, document text NOT NULL, as_of bigint NOT NULL)",
    """CREATE TABLE tokens (
        position bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY, id text NOT NULL UNIQUE, name text NOT NULL,
        role text NOT NULL, token_hash text NOT NULL UNIQUE, created_at double precision NOT NULL,
        revoked_at double precision, expires_at double precision, last_used_at double precision)""",
    "CREATE UNIQUE INDEX ix_tokens_live_name ON tokens (name) WHERE revoked_at IS NULL",
    """CREATE TABLE refusals (
        position bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY, time double precision NOT NULL, actor text NOT NULL,
        token_id text NOT NULL, address text NOT NULL, action text NOT NULL, target text NOT NULL,
        status integer NOT NULL, code text NOT NULL, count integer NOT NULL)""",
    """CREATE TABLE answers (
        key text PRIMARY KEY, request_hash text NOT NULL, status integer NOT NULL, headers text NOT NULL,
        body bytea NOT NULL, stored_at double precision NOT NULL)""",
    "CREATE INDEX ix_answers_stored_at ON answers (stored_at)",
    """CREATE TABLE webhooks (
        position bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY, id text NOT NULL UNIQUE, secret text NOT NULL,
        document text NOT NULL, progress text NOT NULL)""",
    "CREATE TABLE attachments (sha256 text PRIMARY KEY, content bytea NOT NULL)",
    """CREATE FUNCTION refuse_change() RETURNS trigger LANGUAGE plpgsql AS
        $$ BEGIN RAISE EXCEPTION '% never change', TG_TABLE_NAME; END $$""",
    """CREATE TRIGGER events_never_change BEFORE UPDATE OR DELETE OR TRUNCATE ON events
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_change()""",
    """CREATE TRIGGER plans_never_change BEFORE UPDATE OR DELETE OR TRUNCATE ON plans
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_change()""",
)


def upgrade() -> None:
    """Make all tables of an empty database, and name the stream of its events."""
    for table in _TABLES:
        op.execute(table)
    op.execute(f"INSERT INTO stream (id) VALUES ('cluster-{secrets.token_hex(4)}')")
