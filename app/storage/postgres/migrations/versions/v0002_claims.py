"""Claims: which requests with an Idempotency-Key were begun."""

from __future__ import annotations

from alembic import op

revision = "cluster_2"
down_revision = "cluster_1"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make the table."""
    op.execute("CREATE TABLE claims (key text PRIMARY KEY, claimed_at double precision NOT NULL)")
    op.execute("CREATE INDEX ix_claims_claimed_at ON claims (claimed_at)")
