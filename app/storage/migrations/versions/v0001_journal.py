"""The journal: events, plans, runs, jobs, webhooks, tokens, answers, refusals.

Not released yet: it makes what app/storage/schema.py says. With the first release it becomes a copy of these tables.
"""

from __future__ import annotations

from alembic import op

from app.storage.schema import METADATA

revision = "journal_3"
down_revision = None
branch_labels = None
depends_on = None

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


def upgrade() -> None:
    """Make all tables of an empty journal."""
    METADATA.create_all(op.get_bind())
    for trigger in _TRIGGERS:
        op.execute(trigger)
