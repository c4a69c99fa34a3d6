"""/plan-conversions: a plan out of a document of other software. Creates nothing."""

from __future__ import annotations

import asyncio
from typing import Annotated, Any

from aiohttp import web
from pydantic import BaseModel, ConfigDict, Field, RootModel

from app.api.answers import json_answer
from app.api.models import RequestModel
from app.api.routing import API, BINARY, JSON, Answer, AnyRoute, Body, Call, Route
from app.domain.vehicle import VehicleType
from app.interchange.findings import ConversionFinding
from app.interchange.source import SourceFormat, convert_to_plan
from app.services.access import Role


class ForeignPlan(RootModel[dict[str, Any]]):
    """A QGroundControl .plan, or a plan of Waydrop's own. A waypoint file is sent as application/octet-stream."""


class ConversionQuery(RequestModel):
    """`format` only makes sure: it is told from the content. The others count where the document says nothing."""

    format: SourceFormat | None = None
    name: Annotated[str | None, Field(min_length=1, max_length=200, description="of the plan")] = None
    vehicle_type: VehicleType | None = None


class PlanConversion(BaseModel):
    """The plan, ready for /plan-checks and /plans, and what was lost or assumed on the way to it."""

    model_config = ConfigDict(frozen=True)

    format: SourceFormat
    plan: dict[str, Any]
    findings: tuple[ConversionFinding, ...]


async def convert_plan(call: Call[ConversionQuery, bytes]) -> web.Response:
    """POST /plan-conversions."""
    query = call.query
    conversion = await asyncio.to_thread(
        convert_to_plan, call.body, source=query.format, name=query.name, vehicle_type=query.vehicle_type
    )
    plan = conversion.plan.model_dump(mode="json")
    return json_answer(PlanConversion(format=conversion.source, plan=plan, findings=conversion.findings))


ROUTES: tuple[AnyRoute, ...] = (
    Route(
        method="POST",
        path=f"{API}/plan-conversions",
        handler=convert_plan,
        summary="Read a QGroundControl .plan or a waypoint file as a plan",
        tag="plans",
        role=Role.DISPATCHER,
        query=ConversionQuery,
        body=Body(model=ForeignPlan, parse=bytes, codes=("request.malformed",), media=(JSON, BINARY)),
        answers=(Answer(200, "The plan, and every loss and assumption", PlanConversion),),
        errors=("conversion.refused", "plan.invalid"),
    ),
)
