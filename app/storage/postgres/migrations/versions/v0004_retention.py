"""Retention: events and plans may be deleted once an event of the cluster's own chain says so."""

from __future__ import annotations

from alembic import op

revision = "cluster_4"
down_revision = "cluster_3"
branch_labels = None
depends_on = None

_PRUNED = """(SELECT data::json ->> '{}' FROM events WHERE kind = 'journal.pruned'
    AND gateway = (SELECT id FROM stream) ORDER BY position DESC LIMIT 1)"""
_STATEMENTS = (
    "CREATE INDEX ix_events_pruned ON events (gateway, position) WHERE kind = 'journal.pruned'",
    "CREATE INDEX ix_jobs_plan_id ON jobs (plan_id, position)",
    "ALTER TABLE attachments ADD COLUMN attached_at double precision NOT NULL DEFAULT extract(epoch FROM now())",
    # once for each statement, not for each row
    f"""CREATE FUNCTION refuse_early_event() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN
        IF (SELECT max(position) FROM gone) > coalesce({_PRUNED.format("up_to")}::bigint, 0) THEN
            RAISE EXCEPTION 'events are deleted only by retention';
        END IF;
        RETURN NULL; END $$""",
    f"""CREATE FUNCTION refuse_early_plan() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN
        IF (SELECT max(created_at) FROM gone) >= coalesce({_PRUNED.format("before")}::float8, '-infinity') THEN
            RAISE EXCEPTION 'plans are deleted only by retention';
        END IF;
        RETURN NULL; END $$""",
    "DROP TRIGGER events_never_change ON events",
    "DROP TRIGGER plans_never_change ON plans",
    """CREATE TRIGGER events_never_change BEFORE UPDATE OR TRUNCATE ON events
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_change()""",
    """CREATE TRIGGER plans_never_change BEFORE UPDATE OR TRUNCATE ON plans
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_change()""",
    """CREATE TRIGGER events_go_by_age AFTER DELETE ON events REFERENCING OLD TABLE AS gone
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_early_event()""",
    """CREATE TRIGGER plans_go_by_age AFTER DELETE ON plans REFERENCING OLD TABLE AS gone
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_early_plan()""",
)


def upgrade() -> None:
    """Replace the triggers, and give files an age."""
    for statement in _STATEMENTS:
        op.execute(statement)
