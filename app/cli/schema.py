"""`waydrop schema`: the JSON Schema of a plan."""

from __future__ import annotations

from app.cli.terminal import write_json
from app.domain.plan import plan_json_schema


def schema() -> None:
    """Print the JSON Schema (draft 2020-12) of a plan."""
    write_json(plan_json_schema())
