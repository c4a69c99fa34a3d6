"""Runs are found by their time."""

from __future__ import annotations

from alembic import op

revision = "cluster_5"
down_revision = "cluster_4"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make the index."""
    op.execute("CREATE INDEX ix_runs_created_at ON runs (created_at, position)")
