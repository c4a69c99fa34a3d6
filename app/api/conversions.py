"""Plans in other formats: /plan-conversions reads them, /plans/{plan_id}/exports writes them."""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from typing import Annotated, Any, Final

from aiohttp import web
from pydantic import BaseModel, Field, RootModel

from app.api.bodies import JSON, Body, Empty, asked_of, etag_of, is_unchanged, json_answer
from app.api.health import VERSION
from app.api.routing import API, BINARY, BINARY_SCHEMA, STORED, Answer, Call, NoQuery, Routes
from app.domain.model import Frozen, FrozenForm
from app.domain.plan import parse_plan
from app.domain.ports.stores import StoredPlan
from app.domain.validation.plain_text import PLAIN_NAME
from app.domain.vehicle.state import VehicleType
from app.interchange.findings import ConversionFinding
from app.interchange.formats import (
    MEDIA_TYPES,
    Exported,
    PlanConversion,
    RefusedDocument,
    SourceFormat,
    TargetFormat,
    convert_as_json,
    export_plan,
    file_name,
)
from app.services.access import Role
from app.services.plan_work import PlanWork

ROUTES: Final = Routes("plans")


class ForeignPlan(RootModel[dict[str, Any]]):
    """A QGroundControl .plan or a Waydrop plan. Send a waypoint file as application/octet-stream."""


class ConversionQuery(FrozenForm):
    """`format` asserts the format, which is detected from the content. The others fill in what the document omits."""

    format: SourceFormat | None = None
    name: Annotated[str | None, Field(min_length=1, max_length=200, description="of the plan"), PLAIN_NAME] = None
    vehicle_type: VehicleType | None = None


@ROUTES.route(
    "POST",
    "/plan-conversions",
    Role.DISPATCHER,
    Answer(200, "The plan, with a finding for each loss and assumption", PlanConversion),
    body=Body(model=ForeignPlan, parse=bytes, codes=("request.malformed",), media=(JSON, BINARY)),
    errors=("conversion.refused", "plan.invalid", "plan.work_timeout"),
    is_audited=False,
)
async def convert_plan(call: Call[ConversionQuery, bytes]) -> web.Response:
    """Convert a QGroundControl .plan or a waypoint file to a plan."""
    query = call.query
    asked = (query.format, query.name, query.vehicle_type)
    converted = await call.services.plans.work.run_document(call.body, convert_as_json, *asked)
    if isinstance(converted, RefusedDocument):
        raise converted.error()
    return web.Response(body=converted, content_type=JSON)


KEPT: Final = 32
"""Size of the cache, in documents. The document of a plan with 1000 items has about 1 MB."""


class Renderings:
    """Writes exports beside the event loop and caches them. A stored plan never changes, so its exports stay valid.

    Exports are written one at a time: 1000 items take much pure Python, and if it runs in a thread, the event loop that
    supervises drops shares the interpreter.
    """

    def __init__(self, work: PlanWork | None = None, kept: int = KEPT) -> None:
        self._work = work or PlanWork()
        self._kept = kept
        self._documents: OrderedDict[tuple[str, TargetFormat], Exported] = OrderedDict()
        self._turn = asyncio.Lock()

    async def of(self, stored: StoredPlan, target: TargetFormat) -> Exported:
        """Export the plan. Raises PlanInvalid if an older Waydrop stored a plan that this one cannot parse."""
        key = (stored.id, target)
        if key not in self._documents:
            async with self._turn:
                if key not in self._documents:  # another request wrote it in the meantime
                    plan = await asyncio.to_thread(parse_plan, stored.document)
                    self._keep(key, await self._work.run(plan, export_plan, plan, target))
                return self._documents[key]
        self._documents.move_to_end(key)
        return self._documents[key]

    def _keep(self, key: tuple[str, TargetFormat], written: Exported) -> None:
        self._documents[key] = written
        if len(self._documents) > self._kept:
            self._documents.popitem(last=False)


_ERRORS = (*STORED, "plan.invalid", "plan.work_timeout")
_WHAT = {
    TargetFormat.QGC: "Export a plan as a QGroundControl .plan file",
    TargetFormat.GEOJSON: "Export a plan and its prediction as GeoJSON",
    TargetFormat.KML: "Export a plan and its predicted route as KML",
}

RENDERINGS: Final = web.AppKey("renderings", Renderings)


class ExportView(Frozen):
    """An export format. `findings` lists what the document omits or stores in fields that only Waydrop reads."""

    format: TargetFormat
    media_type: str
    path: str
    findings: tuple[ConversionFinding, ...]


class ExportsView(BaseModel):
    """The export formats of a plan."""

    exports: list[ExportView]


@ROUTES.route("GET", "/plans/{plan_id}/exports", Role.VIEWER, Answer(200, "The formats", ExportsView), errors=_ERRORS)
async def list_exports(call: Call[NoQuery, Empty]) -> web.Response:
    """List the export formats of a plan and what each omits."""
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


def _also(target: TargetFormat) -> tuple[str, ...]:
    """Generated clients cannot read the media type of KML."""
    return (BINARY,) if target is TargetFormat.KML else ()


async def _stored(call: Call[NoQuery, Empty]) -> StoredPlan:
    return await call.services.plans.stored(call.path_value("plan_id"))


def _add_export(target: TargetFormat) -> None:
    media = MEDIA_TYPES[target]
    schema = {"type": "string"} if target is TargetFormat.KML else {"type": "object"}

    async def export(call: Call[NoQuery, Empty]) -> web.Response:
        stored = await _stored(call)
        headers = {
            # the ETag is known without writing the document
            "ETag": etag_of(f"{stored.hash}-{target}-{call.request.app[VERSION]}"),
            "Cache-Control": "private, no-cache",
            "Content-Disposition": f'attachment; filename="{file_name(stored.name, target)}"',
            "Vary": "Accept",
        }
        if is_unchanged(call.request, headers["ETag"]):
            return web.Response(status=304, headers=headers)
        exported = await call.request.app[RENDERINGS].of(stored, target)
        content_type = asked_of(call.request, media, *_also(target))
        return web.Response(body=exported.text.encode(), content_type=content_type, headers=headers)

    export.__name__ = f"export_{target}"
    export.__doc__ = _WHAT[target]
    ROUTES.route(
        "GET",
        f"/plans/{{plan_id}}/exports/{target}",
        Role.VIEWER,
        Answer(200, "The document", media=media, schema=schema, headers=("ETag", "Content-Disposition")),
        *(
            Answer(200, "as application/octet-stream if requested", media=m, schema=BINARY_SCHEMA)
            for m in _also(target)
        ),
        Answer(304, "Not modified (If-None-Match)"),
        errors=_ERRORS,
    )(export)


for _target in TargetFormat:
    _add_export(_target)
