"""`waydrop openapi` and `waydrop schema`: the descriptions of the HTTP interface and of plans."""

from __future__ import annotations

from app.cli.terminal import write_json
from app.domain.plan import plan_json_schema


def openapi() -> None:
    """Print the OpenAPI 3.1 document, as served at /api/v1/openapi.json."""
    from app.application import openapi_document

    write_json(openapi_document())


def schema() -> None:
    """Print the JSON Schema (draft 2020-12) of a plan."""
    write_json(plan_json_schema())
