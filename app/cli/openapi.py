"""`waydrop openapi`: the description of the HTTP interface."""

from __future__ import annotations

from app.cli.terminal import write_json


def openapi() -> None:
    """Print the OpenAPI 3.1 document, as served at /api/v1/openapi.json."""
    from app.application import openapi_document

    write_json(openapi_document())
