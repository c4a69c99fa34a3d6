"""Jobs, and the queues of vehicles."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "v0004"
down_revision = "v0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the tables."""
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
