"""/plans: accepted plans. A stored plan is immutable."""

from __future__ import annotations

import asyncio

from aiohttp import web

from app.api.bodies import PLAN_BODY, Empty, etag_of, is_unchanged, json_answer, json_body
from app.api.models import ListQuery, PlanCheckRequest, PlansView
from app.api.routing import API, Answer, AnyRoute, Call, NoQuery, Route, tagged
from app.api.services import FLEET, PLANS
from app.domain.plan import Plan, PlanInvalid, parse_data
from app.domain.prediction import CALM
from app.services.access import Role
from app.services.plans import PlanCheck, PlanView


async def create_plan(call: Call[NoQuery, Plan]) -> web.Response:
    view = await call.request.app[PLANS].create(call.body, actor=call.principal.name)
    headers = {"Location": f"{API}/plans/{view.id}", "ETag": etag_of(view.hash)}
    return json_answer(view, status=201, headers=headers)


async def list_plans(call: Call[ListQuery, Empty]) -> web.Response:
    return json_answer(PlansView(plans=list(await call.request.app[PLANS].list_plans(call.query.limit))))


async def get_plan(call: Call[NoQuery, Empty]) -> web.Response:
    view = await call.request.app[PLANS].get(call.path_value("plan_id"))
    headers = {"ETag": etag_of(view.hash), "Cache-Control": "private, no-cache"}
    if is_unchanged(call.request, headers["ETag"]):
        return web.Response(status=304, headers=headers)
    return json_answer(view, headers=headers)


PLAN_ROUTES: tuple[AnyRoute, ...] = tagged(
    "plans",
    Route(
        method="POST",
        path=f"{API}/plans",
        handler=create_plan,
        summary="Create a plan; rejects a plan with errors",
        role=Role.DISPATCHER,
        body=PLAN_BODY,
        answers=(Answer(201, "The plan as stored", PlanView, headers=("Location", "ETag")),),
        errors=("plan.rejected", "storage.failed"),
        idempotent=True,
    ),
    Route(
        method="GET",
        path=f"{API}/plans",
        handler=list_plans,
        summary="List plans, newest first",
        role=Role.VIEWER,
        query=ListQuery,
        answers=(Answer(200, "The plans", PlansView),),
        errors=("storage.failed",),
    ),
    Route(
        method="GET",
        path=f"{API}/plans/{{plan_id}}",
        handler=get_plan,
        summary="Get a plan with its findings and timeline",
        role=Role.VIEWER,
        answers=(
            Answer(200, "The plan", PlanView, headers=("ETag",)),
            Answer(304, "Not modified (If-None-Match)"),
        ),
        errors=("resource.not_found", "storage.failed"),
    ),
)


# /plan-checks: checks a plan without storing it.


async def check_plan(call: Call[NoQuery, PlanCheckRequest]) -> web.Response:
    """POST /plan-checks. A document that is not a plan gets 200 with findings, too."""
    vehicle_id, fleet = call.body.vehicle, call.request.app[FLEET]
    if vehicle_id is not None:
        fleet.require_usable(vehicle_id)  # before the plan is parsed, so that an unknown vehicle is reported first
    try:
        plan = await asyncio.to_thread(parse_data, call.body.plan)
    except PlanInvalid as error:
        return json_answer(PlanCheck(findings=error.findings, timeline=None))
    facts = None if vehicle_id is None else await fleet.facts(vehicle_id)
    wind = CALM if call.body.wind is None else call.body.wind.wind()
    return json_answer(await asyncio.to_thread(call.request.app[PLANS].check, plan, facts, wind))


CHECK_ROUTES: tuple[AnyRoute, ...] = tagged(
    "plans",
    Route(
        method="POST",
        path=f"{API}/plan-checks",
        handler=check_plan,
        is_audited=False,
        summary="Check a plan without storing it",
        role=Role.DISPATCHER,
        body=json_body(PlanCheckRequest, with_plan=True),
        answers=(Answer(200, "The findings. The status is 200 even if the plan has errors", PlanCheck),),
        errors=("resource.not_found", "vehicle.quarantined", "vehicle.link", "vehicle.timeout", "vehicle.refused"),
    ),
)
