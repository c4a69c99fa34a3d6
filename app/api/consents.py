"""/runs/{run_id}/drops/{item_id}/consent: an operator's answer to a drop that asks for it."""

from __future__ import annotations

from aiohttp import web

from app.api.answers import json_answer
from app.api.bodies import json_body
from app.api.models import ConsentRequest
from app.api.routing import API, Answer, AnyRoute, Call, NoQuery, Route
from app.api.services import RUNS
from app.domain import consent
from app.domain.run import Run
from app.services.access import Role


async def answer_consent(call: Call[NoQuery, ConsentRequest]) -> web.Response:
    """POST /runs/{run_id}/drops/{item_id}/consent."""
    said = consent.Answer(grant=call.body.grant, question=call.body.question, comment=call.body.comment)
    run_id, item_id = call.path_value("run_id"), call.path_value("item_id")
    return json_answer(await call.request.app[RUNS].answer_consent(run_id, item_id, said, call.principal.name))


ROUTES: tuple[AnyRoute, ...] = (
    Route(
        method="POST",
        path=f"{API}/runs/{{run_id}}/drops/{{item_id}}/consent",
        handler=answer_consent,
        summary="Consent to a drop that asks for it, or refuse; the first answer counts, the same again is no error",
        tag="runs",
        role=Role.PILOT,
        query=NoQuery,
        body=json_body(ConsentRequest),
        answers=(Answer(200, "The run with the answer stored; the release follows, checked once more", Run),),
        errors=(
            *("not_found", "drop.consent_not_asked", "drop.consent_too_late", "drop.consent_answered"),
            "storage.failed",
        ),
    ),
)
