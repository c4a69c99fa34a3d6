"""Making JSON answers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

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


def asked_of(request: web.Request, usual: str, *others: str) -> str:
    """The media type that the Accept headers prefer; `usual` is what everybody gets who does not say."""
    return preferred(request.headers.getall("Accept", []), usual, *others)


def preferred(accept: Iterable[str], usual: str, *others: str) -> str:
    """The one of these media types that is named with the highest weight, `usual` if none is."""
    weights = dict.fromkeys((usual, *others), 0.0)
    for part in ",".join(accept).split(","):
        name, *parameters = (piece.strip().lower() for piece in part.split(";"))
        weight = next((_weight(one[2:]) for one in parameters if one.startswith("q=")), 1.0)
        if name in weights:
            weights[name] = max(weights[name], weight)
    return max(weights, key=weights.__getitem__)


def _weight(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0
