"""Making JSON answers."""

from __future__ import annotations

from collections.abc import Mapping

from aiohttp import web
from pydantic import BaseModel


def json_answer(model: BaseModel, *, status: int = 200, headers: Mapping[str, str] | None = None) -> web.Response:
    """A model as the answer's body."""
    body = model.model_dump_json().encode()
    return web.Response(body=body, status=status, content_type="application/json", headers=dict(headers or {}))


def etag_of(value: str) -> str:
    """A strong ETag."""
    return f'"{value}"'


def is_unchanged(request: web.Request, etag: str) -> bool:
    """Whether the client already has this (If-None-Match)."""
    given = request.headers.getall("If-None-Match", [])
    tags = {tag.strip().removeprefix("W/") for line in given for tag in line.split(",")}
    return etag in tags or "*" in tags
