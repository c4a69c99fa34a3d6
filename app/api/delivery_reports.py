"""/runs/{run_id}/proof and /runs/{run_id}/comparison: the delivery report, and predicted against flown."""

from __future__ import annotations

import asyncio
import re

from aiohttp import web

from app.api.bodies import NO_BODY, Empty, json_answer
from app.api.proof_sheet.page import POLICY, proof_sheet
from app.api.routing import API, Answer, AnyRoute, Call, NoQuery, Route
from app.api.services import COMPARISONS, PROOFS
from app.domain.proof.comparison import Comparison
from app.domain.proof.delivery_report import Proof
from app.services.access import Role

# /runs/{run_id}/proof: proof of delivery, as data and as a sheet.


async def get_proof(call: Call[NoQuery, Empty]) -> web.Response:
    """GET /runs/{run_id}/proof."""
    issued = await call.request.app[PROOFS].of(call.path_value("run_id"))
    return await asyncio.to_thread(json_answer, issued.proof)  # a long story is long to write


async def get_sheet(call: Call[NoQuery, Empty]) -> web.Response:
    """GET /runs/{run_id}/proof-sheet."""
    proofs = call.request.app[PROOFS]
    issued = await proofs.of(call.path_value("run_id"))
    pictures = await proofs.pictures(issued)
    name = re.sub(r"[^A-Za-z0-9_-]", "-", issued.proof.run_id)
    headers = {
        "Content-Security-Policy": POLICY,
        "Content-Disposition": f'inline; filename="proof-{name}.html"',
    }
    text = await asyncio.to_thread(proof_sheet, issued.proof, issued.plan, pictures)
    return web.Response(text=text, content_type="text/html", headers=headers)


REPORT_ROUTES: tuple[AnyRoute, ...] = (
    Route(
        method="GET",
        path=f"{API}/runs/{{run_id}}/proof",
        handler=get_proof,
        summary="Proof of delivery: what flew, how each drop ended, and the events that say so",
        tag="runs",
        role=Role.VIEWER,
        query=NoQuery,
        body=NO_BODY,
        answers=(Answer(200, "The proof, as of now", Proof),),
        errors=("not_found", "storage.failed"),
    ),
    Route(
        method="GET",
        path=f"{API}/runs/{{run_id}}/proof-sheet",
        handler=get_sheet,
        summary="The proof as a page to print or file, with maps",
        tag="runs",
        role=Role.VIEWER,
        query=NoQuery,
        body=NO_BODY,
        answers=(Answer(200, "The sheet", media="text/html", schema={"type": "string"}),),
        errors=("not_found", "storage.failed"),
    ),
)


# /runs/{run_id}/comparison: predicted against flown.


async def get_comparison(call: Call[NoQuery, Empty]) -> web.Response:
    """GET /runs/{run_id}/comparison."""
    return json_answer(await call.request.app[COMPARISONS].of(call.path_value("run_id")))


COMPARISON_ROUTES: tuple[AnyRoute, ...] = (
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
