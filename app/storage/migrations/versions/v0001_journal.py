"""The journal: events, plans, runs, jobs, webhooks, tokens, answers, refusals.

Not released yet: it makes what app/storage/schema.py says. With the first release it becomes a copy of these tables.
"""

from __future__ import annotations

from alembic import op

from app.storage.schema import make_tables

revision = "journal_3"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make all tables of an empty journal."""
    make_tables(op.get_bind())
