"""/plans: accepted plans. A stored plan is immutable."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Final

from aiohttp import web

from app.api.bodies import JSON, PLAN_BODY, Empty, etag_of, is_unchanged, json_answer, json_body
from app.api.models import PlanCheckRequest, PlansQuery, PlansView
from app.api.routing import API, STORED, VEHICLE, Answer, Call, NoQuery, Routes
from app.domain.plan import Plan
from app.domain.prediction import CALM
from app.services.access import Role
from app.services.plan_checks import PlanCheck
from app.services.plans import PlanView

ROUTES: Final = Routes("plans")


@ROUTES.route(
    "POST",
    "/plans",
    Role.DISPATCHER,
    Answer(201, "The plan as stored", PlanView, headers=("Location", "ETag")),
    body=PLAN_BODY,
    errors=("plan.rejected", "plan.work_timeout", "storage.failed"),
)
async def create_plan(call: Call[NoQuery, Plan]) -> web.Response:
    """Create a plan; rejects a plan with errors."""
    plans, answer = call.services.plans, call.answered(_created)
    return _created(await plans.create(call.body, actor=call.principal.name, answer=answer))


def _created(view: PlanView) -> web.Response:
    return _tagged(view, status=201, headers={"Location": f"{API}/plans/{view.id}"})


def _tagged(view: PlanView, *, status: int, headers: Mapping[str, str]) -> web.Response:
    """With an ETag of what is sent: another version may find and predict something else for the same document."""
    body = view.model_dump_json().encode()
    tag = etag_of(hashlib.sha256(body).hexdigest())
    return web.Response(body=body, status=status, content_type=JSON, headers={"ETag": tag, **headers})


@ROUTES.route("GET", "/plans", Role.VIEWER, Answer(200, "The plans", PlansView), errors=STORED)
async def list_plans(call: Call[PlansQuery, Empty]) -> web.Response:
    """List plans, newest first."""
    query = call.query
    found = await call.services.plans.list_plans(query.limit + 1, query.older_than)
    page = list(found[: query.limit])
    return json_answer(PlansView(plans=page, next=page[-1].id if len(found) > query.limit else None))


@ROUTES.route(
    "GET",
    "/plans/{plan_id}",
    Role.VIEWER,
    Answer(200, "The plan", PlanView, headers=("ETag",)),
    Answer(304, "Not modified (If-None-Match)"),
    errors=(*STORED, "plan.work_timeout"),
)
async def get_plan(call: Call[NoQuery, Empty]) -> web.Response:
    """Get a plan with its findings and timeline."""
    view = await call.services.plans.get(call.path_value("plan_id"))
    caching = {"Cache-Control": "private, no-cache"}
    response = _tagged(view, status=200, headers=caching)
    tag = response.headers["ETag"]
    return web.Response(status=304, headers={"ETag": tag, **caching}) if is_unchanged(call.request, tag) else response


@ROUTES.route(
    "POST",
    "/plan-checks",
    Role.DISPATCHER,
    Answer(200, "The findings. The status is 200 even if the plan has errors", PlanCheck),
    body=json_body(PlanCheckRequest, with_plan=True),
    errors=(*VEHICLE, "resource.not_found", "plan.work_timeout"),
    is_audited=False,
)
async def check_plan(call: Call[NoQuery, PlanCheckRequest]) -> web.Response:
    """Check a plan without storing it.

    POST /plan-checks. A document that is not a plan gets 200 with findings, too.
    """
    vehicle_id, fleet = call.body.vehicle, call.services.fleet
    if vehicle_id is not None:
        fleet.require_usable(vehicle_id)  # before the plan is parsed, so that an unknown vehicle is reported first
    plans, document, facts = call.services.plans, call.body.plan, None
    if vehicle_id is not None and await plans.is_plan(document):  # what is no plan is told without its facts
        facts = await fleet.facts(vehicle_id)
    wind = CALM if call.body.wind is None else call.body.wind.wind()
    return web.Response(body=await plans.check_as_json(document, facts, wind), content_type=JSON)
