"""/plan-checks: what would be said of a plan, without storing it."""

from __future__ import annotations

import asyncio

from aiohttp import web

from app.api.answers import json_answer
from app.api.bodies import json_body
from app.api.models import PlanCheckRequest
from app.api.routing import API, Answer, AnyRoute, Call, NoQuery, Route
from app.api.services import FLEET, PLANS
from app.domain.plan import PlanInvalid, parse_data
from app.domain.prediction import CALM
from app.services.access import Role
from app.services.plans import PlanCheck


async def check_plan(call: Call[NoQuery, PlanCheckRequest]) -> web.Response:
    """POST /plan-checks. A document that is no plan at all is answered with findings too."""
    vehicle_id, fleet = call.body.vehicle, call.request.app[FLEET]
    if vehicle_id is not None:
        fleet.link(vehicle_id)  # before the plan is read: there is no such vehicle
    try:
        plan = await asyncio.to_thread(parse_data, call.body.plan)
    except PlanInvalid as error:
        return json_answer(PlanCheck(findings=error.findings, timeline=None))
    facts = None if vehicle_id is None else await fleet.facts(vehicle_id)
    wind = CALM if call.body.wind is None else call.body.wind.wind()
    return json_answer(await asyncio.to_thread(call.request.app[PLANS].check, plan, facts, wind))


ROUTES: tuple[AnyRoute, ...] = (
    Route(
        method="POST",
        path=f"{API}/plan-checks",
        handler=check_plan,
        summary="Check a plan: its findings and its timeline",
        tag="plans",
        role=Role.DISPATCHER,
        query=NoQuery,
        body=json_body(PlanCheckRequest, with_plan=True),
        answers=(Answer(200, "What was found; a plan with errors is answered with 200 too", PlanCheck),),
        errors=("not_found", "vehicle.quarantined", "vehicle.link", "vehicle.timeout", "vehicle.refused"),
    ),
)
