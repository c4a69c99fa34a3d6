"""/plans/{plan_id}/exports: a stored plan in the formats of other software."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Final

from aiohttp import web
from pydantic import BaseModel, ConfigDict

from app.api.answers import asked_of, etag_of, is_unchanged, json_answer
from app.api.bodies import NO_BODY, Empty
from app.api.health import VERSION
from app.api.renderings import Renderings
from app.api.routing import API, BINARY, BINARY_SCHEMA, Answer, AnyRoute, Call, NoQuery, Route
from app.api.services import PLANS
from app.domain.ports import StoredPlan
from app.interchange.findings import ConversionFinding
from app.interchange.target import MEDIA_TYPES, TargetFormat, file_name
from app.services.access import Role

_ERRORS = ("not_found", "plan.invalid", "storage.failed")
_WHAT = {
    TargetFormat.QGC: "A plan as a QGroundControl .plan",
    TargetFormat.GEOJSON: "A plan and its prediction as GeoJSON",
    TargetFormat.KML: "A plan and its predicted route as KML",
}

RENDERINGS: Final = web.AppKey("renderings", Renderings)


class ExportView(BaseModel):
    """One format. `findings` are what the document leaves out, or has in a place that only Waydrop reads."""

    model_config = ConfigDict(frozen=True)

    format: TargetFormat
    media_type: str
    path: str
    findings: tuple[ConversionFinding, ...]


class ExportsView(BaseModel):
    """All formats that a plan can be had in."""

    exports: list[ExportView]


async def list_exports(call: Call[NoQuery, Empty]) -> web.Response:
    """GET /plans/{plan_id}/exports."""
    stored = await _stored(call)
    written = [(target, await call.request.app[RENDERINGS].of(stored, target)) for target in TargetFormat]
    views = [
        ExportView(
            format=target,
            media_type=MEDIA_TYPES[target],
            path=f"{API}/plans/{call.path_value('plan_id')}/exports/{target}",
            findings=exported.findings,
        )
        for target, exported in written
    ]
    return json_answer(ExportsView(exports=views))


def _exporter(target: TargetFormat) -> Callable[[Call[NoQuery, Empty]], Awaitable[web.Response]]:
    async def export(call: Call[NoQuery, Empty]) -> web.Response:
        stored = await _stored(call)
        headers = {
            "ETag": etag_of(f"{stored.hash}-{target}-{call.request.app[VERSION]}"),  # known before anything is written
            "Cache-Control": "private, no-cache",
            "Content-Disposition": f'attachment; filename="{file_name(stored.name, target)}"',
            "Vary": "Accept",
        }
        if is_unchanged(call.request, headers["ETag"]):
            return web.Response(status=304, headers=headers)
        exported = await call.request.app[RENDERINGS].of(stored, target)
        media = asked_of(call.request, MEDIA_TYPES[target], *_also(target))
        return web.Response(body=exported.text.encode(), content_type=media, headers=headers)

    export.__name__ = f"export_{target}"
    return export


def _also(target: TargetFormat) -> tuple[str, ...]:
    """KML's own media type is nothing that a generated client can read."""
    return (BINARY,) if target is TargetFormat.KML else ()


async def _stored(call: Call[NoQuery, Empty]) -> StoredPlan:
    return await call.request.app[PLANS].stored(call.path_value("plan_id"))


def _route(target: TargetFormat) -> AnyRoute:
    schema = {"type": "string"} if target is TargetFormat.KML else {"type": "object"}
    headers = ("ETag", "Content-Disposition")
    return Route(
        method="GET",
        path=f"{API}/plans/{{plan_id}}/exports/{target}",
        handler=_exporter(target),
        summary=_WHAT[target],
        tag="plans",
        role=Role.VIEWER,
        query=NoQuery,
        body=NO_BODY,
        answers=(
            Answer(200, "The document", media=MEDIA_TYPES[target], schema=schema, headers=headers),
            *(Answer(200, "as plain bytes if asked for", media=m, schema=BINARY_SCHEMA) for m in _also(target)),
            Answer(304, "The client has it already (If-None-Match)"),
        ),
        errors=_ERRORS,
    )


ROUTES: tuple[AnyRoute, ...] = (
    Route(
        method="GET",
        path=f"{API}/plans/{{plan_id}}/exports",
        handler=list_exports,
        summary="The formats that a plan can be had in, and what each leaves out",
        tag="plans",
        role=Role.VIEWER,
        query=NoQuery,
        body=NO_BODY,
        answers=(Answer(200, "The formats", ExportsView),),
        errors=_ERRORS,
    ),
    *(_route(target) for target in TargetFormat),
)
