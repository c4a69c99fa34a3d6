"""/plans: accepted plans, never changed after they are stored."""

from __future__ import annotations

from aiohttp import web

from app.api.answers import etag_of, is_unchanged, json_answer
from app.api.bodies import NO_BODY, PLAN_BODY, Empty
from app.api.models import ListQuery, PlansView
from app.api.routing import API, Answer, AnyRoute, Call, NoQuery, Route
from app.api.services import PLANS
from app.domain.plan import Plan
from app.services.access import Role
from app.services.plans import PlanView


async def create_plan(call: Call[NoQuery, Plan]) -> web.Response:
    """POST /plans."""
    view = await call.request.app[PLANS].create(call.body, by=call.principal.name)
    headers = {"Location": f"{API}/plans/{view.id}", "ETag": etag_of(view.hash)}
    return json_answer(view, status=201, headers=headers)


async def list_plans(call: Call[ListQuery, Empty]) -> web.Response:
    """GET /plans."""
    return json_answer(PlansView(plans=list(await call.request.app[PLANS].list_plans(call.query.limit))))


async def get_plan(call: Call[NoQuery, Empty]) -> web.Response:
    """GET /plans/{plan_id}."""
    view = await call.request.app[PLANS].get(call.path_value("plan_id"))
    headers = {"ETag": etag_of(view.hash), "Cache-Control": "private, no-cache"}
    if is_unchanged(call.request, headers["ETag"]):
        return web.Response(status=304, headers=headers)
    return json_answer(view, headers=headers)


ROUTES: tuple[AnyRoute, ...] = (
    Route(
        method="POST",
        path=f"{API}/plans",
        handler=create_plan,
        summary="Store a plan, if it can be flown",
        tag="plans",
        role=Role.DISPATCHER,
        query=NoQuery,
        body=PLAN_BODY,
        answers=(Answer(201, "The plan as stored", PlanView, headers=("Location", "ETag")),),
        errors=("plan.rejected", "storage.failed"),
        idempotent=True,
    ),
    Route(
        method="GET",
        path=f"{API}/plans",
        handler=list_plans,
        summary="Plans, newest first",
        tag="plans",
        role=Role.VIEWER,
        query=ListQuery,
        body=NO_BODY,
        answers=(Answer(200, "The plans", PlansView),),
        errors=("storage.failed",),
    ),
    Route(
        method="GET",
        path=f"{API}/plans/{{plan_id}}",
        handler=get_plan,
        summary="One plan with its findings and timeline",
        tag="plans",
        role=Role.VIEWER,
        query=NoQuery,
        body=NO_BODY,
        answers=(
            Answer(200, "The plan", PlanView, headers=("ETag",)),
            Answer(304, "The client has it already (If-None-Match)"),
        ),
        errors=("not_found", "storage.failed"),
    ),
)
