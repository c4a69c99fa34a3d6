"""Routes by which a pilot acts on a vehicle: what is asked, and the lease that allows it, come in a JSON body."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Literal, TypeVar

from aiohttp import web
from pydantic import BaseModel

from app.api.bodies import json_body
from app.api.routing import Answer, Call, NoQuery, Route
from app.services.access import Role

ModelT = TypeVar("ModelT", bound=BaseModel)


def pilot_route(
    tag: str,
    path: str,
    handler: Callable[[Call[NoQuery, ModelT]], Awaitable[web.StreamResponse]],
    body: type[ModelT],
    summary: str,
    *,
    answer: Answer,
    errors: tuple[str, ...],
    method: Literal["POST", "PATCH", "DELETE"] = "POST",
    idempotent: bool = False,
) -> Route[NoQuery, ModelT]:
    """The row of one action, for pilots and administrators."""
    return Route(
        method=method,
        path=path,
        handler=handler,
        summary=summary,
        tag=tag,
        role=Role.PILOT,
        query=NoQuery,
        body=json_body(body),
        answers=(answer,),
        errors=errors,
        idempotent=idempotent,
    )
