"""Each event gets the hash of its chain (domain/journal_chain.py); events that are there are chained as they stand."""

from __future__ import annotations

import hashlib
import json

import sqlalchemy as sa
from alembic import op

revision = "v0002"
down_revision = "v0001"
branch_labels = None
depends_on = None

_FROZEN = """CREATE TRIGGER events_never_change BEFORE UPDATE ON events
    BEGIN SELECT RAISE(ABORT, 'events never change'); END"""
_BATCH = 1000


def upgrade() -> None:
    """Add the column, fill it, and freeze the events again."""
    op.execute("DROP TRIGGER events_never_change")
    op.add_column("events", sa.Column("hash", sa.Text, nullable=False, server_default=sa.text("''")))
    _chain(op.get_bind())
    op.execute(_FROZEN)


def _chain(connection: sa.Connection) -> None:
    gateway = connection.execute(sa.text("SELECT id FROM gateway")).scalar_one_or_none()
    previous, after = "0" * 64, 0
    while True:
        query = sa.text(
            "SELECT seq, kind, time, vehicle_id, run_id, data FROM events WHERE seq > :after ORDER BY seq LIMIT :n"
        )
        rows = connection.execute(query, {"after": after, "n": _BATCH}).all()
        if not rows:
            return
        hashes = []
        for row in rows:
            # as it was when this step was made: a later change of the rule is a later step
            text = json.dumps([previous, gateway, *row], ensure_ascii=False, allow_nan=False, separators=(",", ":"))
            previous, after = hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest(), row.seq
            hashes.append({"seq": row.seq, "hash": previous})
        connection.execute(sa.text("UPDATE events SET hash = :hash WHERE seq = :seq"), hashes)
