"""/runs/{run_id}/comparison: predicted against flown."""

from __future__ import annotations

from aiohttp import web

from app.api.answers import json_answer
from app.api.bodies import NO_BODY, Empty
from app.api.routing import API, Answer, AnyRoute, Call, NoQuery, Route
from app.api.services import COMPARISONS
from app.domain.comparison import Comparison
from app.services.access import Role


async def get_comparison(call: Call[NoQuery, Empty]) -> web.Response:
    """GET /runs/{run_id}/comparison."""
    return json_answer(await call.request.app[COMPARISONS].of(call.path_value("run_id")))


ROUTES: tuple[AnyRoute, ...] = (
    Route(
        method="GET",
        path=f"{API}/runs/{{run_id}}/comparison",
        handler=get_comparison,
        summary="Predicted against flown: each item's time, each drop's release",
        tag="runs",
        role=Role.VIEWER,
        query=NoQuery,
        body=NO_BODY,
        answers=(Answer(200, "The comparison, as of now", Comparison),),
        errors=("not_found", "storage.failed"),
    ),
)
