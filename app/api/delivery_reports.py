"""/runs/{run_id}/delivery-report and /runs/{run_id}/comparison (predicted against flown)."""

from __future__ import annotations

import asyncio
import re

from aiohttp import web

from app.api.bodies import Empty, json_answer
from app.api.delivery_report_page.page import POLICY, delivery_report_page
from app.api.routing import API, Answer, AnyRoute, Call, NoQuery, Route, tagged
from app.api.services import COMPARISONS, DELIVERY_REPORTS
from app.domain.delivery.comparison import Comparison
from app.domain.delivery.delivery_report import DeliveryReport
from app.services.access import Role

# /runs/{run_id}/delivery-report: the delivery report as JSON and as HTML.


async def get_delivery_report(call: Call[NoQuery, Empty]) -> web.Response:
    issued = await call.request.app[DELIVERY_REPORTS].of(call.path_value("run_id"))
    return await asyncio.to_thread(json_answer, issued.report)  # the report of a long run takes a while to render


async def get_delivery_report_page(call: Call[NoQuery, Empty]) -> web.Response:
    delivery_reports = call.request.app[DELIVERY_REPORTS]
    issued = await delivery_reports.of(call.path_value("run_id"))
    pictures = await delivery_reports.pictures(issued)
    name = re.sub(r"[^A-Za-z0-9_-]", "-", issued.report.run_id)
    headers = {
        "Content-Security-Policy": POLICY,
        "Content-Disposition": f'inline; filename="delivery-report-{name}.html"',
    }
    text = await asyncio.to_thread(delivery_report_page, issued.report, issued.plan, pictures)
    return web.Response(text=text, content_type="text/html", headers=headers)


REPORT_ROUTES: tuple[AnyRoute, ...] = tagged(
    "runs",
    Route(
        method="GET",
        path=f"{API}/runs/{{run_id}}/delivery-report",
        handler=get_delivery_report,
        summary="Get the delivery report: what flew, how each drop ended, and the events as evidence",
        role=Role.VIEWER,
        answers=(Answer(200, "The current delivery report", DeliveryReport),),
        errors=("resource.not_found", "storage.failed"),
    ),
    Route(
        method="GET",
        path=f"{API}/runs/{{run_id}}/delivery-report.html",
        handler=get_delivery_report_page,
        summary="Get the delivery report as a printable HTML page with maps",
        role=Role.VIEWER,
        answers=(Answer(200, "The HTML page", media="text/html", schema={"type": "string"}),),
        errors=("resource.not_found", "storage.failed"),
    ),
)


# /runs/{run_id}/comparison: predicted against flown.


async def get_comparison(call: Call[NoQuery, Empty]) -> web.Response:
    return json_answer(await call.request.app[COMPARISONS].of(call.path_value("run_id")))


COMPARISON_ROUTES: tuple[AnyRoute, ...] = tagged(
    "runs",
    Route(
        method="GET",
        path=f"{API}/runs/{{run_id}}/comparison",
        handler=get_comparison,
        summary="Compare predicted and flown times of items and positions of releases",
        role=Role.VIEWER,
        answers=(Answer(200, "The comparison so far", Comparison),),
        errors=("resource.not_found", "storage.failed"),
    ),
)
