"""Alembic's entry: run the steps on the connection that migrate.py hands over, in its transaction."""

from __future__ import annotations

from alembic import context

from app.storage.schema import METADATA

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=METADATA,
    render_as_batch=True,  # SQLite alters a table by copying it
    transactional_ddl=True,
)
context.run_migrations()
