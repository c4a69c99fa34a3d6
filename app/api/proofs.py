"""/runs/{run_id}/proof: proof of delivery, as data and as a sheet."""

from __future__ import annotations

import asyncio
import re

from aiohttp import web

from app.api.answers import json_answer
from app.api.bodies import NO_BODY, Empty
from app.api.proof_sheet.page import POLICY, proof_sheet
from app.api.routing import API, Answer, AnyRoute, Call, NoQuery, Route
from app.api.services import PROOFS
from app.domain.proof import Proof
from app.services.access import Role


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


ROUTES: tuple[AnyRoute, ...] = (
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
