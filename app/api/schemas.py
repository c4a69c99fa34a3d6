"""/schemas: what a plan must look like, for editors and other programs."""

from __future__ import annotations

from typing import Final

from aiohttp import web
from pydantic_core import to_json

from app.api.bodies import NO_BODY, Empty
from app.api.routing import API, Answer, AnyRoute, Call, NoQuery, Route
from app.domain.plan import plan_json_schema

MEDIA: Final = "application/schema+json"
_PLAN_SCHEMA: Final = to_json(plan_json_schema())


async def get_plan_schema(_: Call[NoQuery, Empty]) -> web.Response:
    """GET /schemas/plan."""
    return web.Response(body=_PLAN_SCHEMA, content_type=MEDIA)


ROUTES: tuple[AnyRoute, ...] = (
    Route(
        method="GET",
        path=f"{API}/schemas/plan",
        handler=get_plan_schema,
        summary="The JSON Schema of a plan",
        tag="documents",
        role=None,
        query=NoQuery,
        body=NO_BODY,
        answers=(Answer(200, "JSON Schema, draft 2020-12", media=MEDIA, schema={"type": "object"}),),
    ),
)
