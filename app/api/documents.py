"""OpenAPI, AsyncAPI and the list of problem codes. Generated once and served from memory."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from aiohttp import web
from pydantic_core import to_json

from app.api.bodies import Empty
from app.api.problems import PROBLEMS
from app.api.routing import Answer, Call, NoQuery, Routes
from app.domain.plan import plan_json_schema

ROUTES: Final = Routes("documents")


@dataclass(frozen=True, slots=True)
class EncodedDocuments:
    """The encoded documents."""

    openapi: bytes
    asyncapi: bytes


class Documents:
    """Generated in a thread on the first request, because it takes half a second."""

    def __init__(self, make: Callable[[], EncodedDocuments]) -> None:
        self._make = make
        self._making: asyncio.Task[EncodedDocuments] | None = None

    async def encoded(self) -> EncodedDocuments:
        if self._making is None:
            self._making = asyncio.create_task(asyncio.to_thread(self._make), name="API documents")
        return await asyncio.shield(self._making)


DOCUMENTS: Final = web.AppKey("documents", Documents)
_PROBLEMS: Final = to_json(
    {
        "problems": [
            {"code": kind.code, "status": kind.status, "title": kind.title, "hint": kind.hint}
            for kind in PROBLEMS.values()
        ]
    }
)


def encode(openapi: dict[str, Any], asyncapi: dict[str, Any]) -> EncodedDocuments:
    return EncodedDocuments(to_json(openapi), to_json(asyncapi))


_DOCUMENT: Final = Answer(200, "The document", schema={"type": "object"})


@ROUTES.route("GET", "/openapi.json", None, _DOCUMENT)
async def get_openapi(call: Call[NoQuery, Empty]) -> web.Response:
    """Get this OpenAPI 3.1 document."""
    body = (await call.request.app[DOCUMENTS].encoded()).openapi
    return web.Response(body=body, content_type="application/json")


@ROUTES.route("GET", "/asyncapi.json", None, _DOCUMENT)
async def get_asyncapi(call: Call[NoQuery, Empty]) -> web.Response:
    """Get the AsyncAPI 3 document of the websockets."""
    body = (await call.request.app[DOCUMENTS].encoded()).asyncapi
    return web.Response(body=body, content_type="application/json")


@ROUTES.route("GET", "/problems", None, _DOCUMENT)
async def list_problems(_: Call[NoQuery, Empty]) -> web.Response:
    """List problem codes.

    The page that the `type` of a problem refers to.
    """
    return web.Response(body=_PROBLEMS, content_type="application/json")


MEDIA: Final = "application/schema+json"


@ROUTES.route(
    "GET", "/schemas/plan", None, Answer(200, "JSON Schema, draft 2020-12", media=MEDIA, schema={"type": "object"})
)
async def get_plan_schema(_: Call[NoQuery, Empty]) -> web.Response:
    """Get the JSON Schema of a plan."""
    return web.Response(body=to_json(await asyncio.to_thread(plan_json_schema)), content_type=MEDIA)
