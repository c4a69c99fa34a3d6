"""Tokens expire, have unique names and a time of last use; rejected requests are kept for the audit."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "journal_2"
down_revision = "journal_1"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Change the tokens, create the refusals."""
    op.add_column("tokens", sa.Column("expires_at", sa.Double))
    op.add_column("tokens", sa.Column("last_used_at", sa.Double))
    op.execute(_RENAME_TWINS)
    op.create_index("ix_tokens_live_name", "tokens", ["name"], unique=True, sqlite_where=sa.text("revoked_at IS NULL"))
    op.create_table(
        "refusals",
        sa.Column("position", sa.Integer, primary_key=True),
        sa.Column("time", sa.Double, nullable=False),
        sa.Column("actor", sa.Text, nullable=False),
        sa.Column("token_id", sa.Text, nullable=False),
        sa.Column("address", sa.Text, nullable=False),
        sa.Column("action", sa.Text, nullable=False),
        sa.Column("target", sa.Text, nullable=False),
        sa.Column("status", sa.Integer, nullable=False),
        sa.Column("code", sa.Text, nullable=False),
        sa.Column("count", sa.Integer, nullable=False),
    )
    op.create_index("ix_events_accepted", "events", ["seq"], sqlite_where=sa.text("kind = 'request.accepted'"))


# of live tokens with one name all but the oldest get their id behind it
_RENAME_TWINS = """
UPDATE tokens SET name = name || ' (' || id || ')' WHERE revoked_at IS NULL AND EXISTS (
  SELECT 1 FROM tokens AS older
  WHERE older.name = tokens.name AND older.revoked_at IS NULL AND older.position < tokens.position
)"""
