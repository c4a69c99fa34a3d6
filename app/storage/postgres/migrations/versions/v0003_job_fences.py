"""Jobs of the cluster: the fencing number of its own newest change."""

from __future__ import annotations

from alembic import op

revision = "cluster_3"
down_revision = "cluster_2"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column."""
    op.execute("ALTER TABLE jobs ADD COLUMN own_fence integer NOT NULL DEFAULT 0")
