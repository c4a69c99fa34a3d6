"""The newest events of flying by hand are found without reading the journal."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "v0005"
down_revision = "v0004"
branch_labels = None
depends_on = None

_BY_HAND = "kind IN ('offboard.lease', 'offboard.changed', 'tasks.changed')"


def upgrade() -> None:
    """Add the index; it is of these few events alone."""
    op.create_index("ix_events_by_hand", "events", ["kind", "vehicle_id", "seq"], sqlite_where=sa.text(_BY_HAND))
