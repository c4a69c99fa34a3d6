"""Indexes: runs by their time, and jobs by their plan, which journals of one early version of journal_3 lack."""

from __future__ import annotations

from alembic import op

revision = "journal_4"
down_revision = "journal_3"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make what is missing: journal_3 makes today's tables."""
    op.execute("CREATE INDEX IF NOT EXISTS ix_runs_created_at_position ON runs (created_at, position)")
    op.execute("CREATE INDEX IF NOT EXISTS ix_jobs_plan_id_position ON jobs (plan_id, position)")
