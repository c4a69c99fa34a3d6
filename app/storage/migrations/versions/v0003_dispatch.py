"""Webhooks; and runs can be searched by state and time of creation."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "v0003"
down_revision = "v0002"
branch_labels = None
depends_on = None

_FILL = """UPDATE runs SET state = coalesce(json_extract(document, '$.state'), ''),
    created_at = coalesce(json_extract(document, '$.created_at'), 0)
    WHERE json_valid(document)"""


def upgrade() -> None:
    """Add the table and the columns, and fill them from the documents."""
    op.create_table(
        "webhooks",
        sa.Column("position", sa.Integer, primary_key=True),
        sa.Column("id", sa.Text, nullable=False, unique=True),
        sa.Column("secret", sa.Text, nullable=False),
        sa.Column("document", sa.Text, nullable=False),
        sa.Column("progress", sa.Text, nullable=False),
    )
    op.add_column("runs", sa.Column("state", sa.Text, nullable=False, server_default=sa.text("''")))
    op.add_column("runs", sa.Column("created_at", sa.Double, nullable=False, server_default=sa.text("0")))
    op.execute(_FILL)
    op.create_index("ix_runs_plan_id_position", "runs", ["plan_id", "position"])
    op.create_index("ix_runs_state_position", "runs", ["state", "position"])
