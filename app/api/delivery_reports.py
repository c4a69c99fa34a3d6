"""/runs/{run_id}/delivery-report and /runs/{run_id}/comparison (predicted against flown)."""

from __future__ import annotations

import asyncio
import re
from typing import Final

from aiohttp import web

from app.api.bodies import Empty, json_answer
from app.api.delivery_report_page.page import POLICY, delivery_report_page
from app.api.routing import STORED, Answer, Call, NoQuery, Routes
from app.domain.delivery.comparison import Comparison
from app.domain.delivery.delivery_report import DeliveryReport
from app.services.access import Role

ROUTES: Final = Routes("runs")


@ROUTES.route(
    "GET",
    "/runs/{run_id}/delivery-report",
    Role.VIEWER,
    Answer(200, "The current delivery report", DeliveryReport),
    errors=STORED,
)
async def get_delivery_report(call: Call[NoQuery, Empty]) -> web.Response:
    """Get the delivery report: what flew, how each drop ended, and the events as evidence."""
    issued = await call.services.delivery_reports.of(call.path_value("run_id"))
    return await asyncio.to_thread(json_answer, issued.report)  # the report of a long run takes a while to render


@ROUTES.route(
    "GET",
    "/runs/{run_id}/delivery-report.html",
    Role.VIEWER,
    Answer(200, "The HTML page", media="text/html", schema={"type": "string"}),
    errors=STORED,
)
async def get_delivery_report_page(call: Call[NoQuery, Empty]) -> web.Response:
    """Get the delivery report as a printable HTML page with maps."""
    delivery_reports = call.services.delivery_reports
    issued = await delivery_reports.of(call.path_value("run_id"))
    pictures = await delivery_reports.pictures(issued)
    name = re.sub(r"[^A-Za-z0-9_-]", "-", issued.report.run_id)
    headers = {
        "Content-Security-Policy": POLICY,
        "Content-Disposition": f'inline; filename="delivery-report-{name}.html"',
    }
    text = await asyncio.to_thread(delivery_report_page, issued.report, issued.plan, pictures)
    return web.Response(text=text, content_type="text/html", headers=headers)


@ROUTES.route(
    "GET", "/runs/{run_id}/comparison", Role.VIEWER, Answer(200, "The comparison so far", Comparison), errors=STORED
)
async def get_comparison(call: Call[NoQuery, Empty]) -> web.Response:
    """Compare predicted and flown times of items and positions of releases."""
    return json_answer(await call.services.comparisons.of(call.path_value("run_id")))
