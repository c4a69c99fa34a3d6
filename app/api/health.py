"""/healthz, /readyz and /metrics, for orchestrators and monitoring."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from aiohttp import web

from app.api.bodies import Empty, json_answer
from app.api.models import HealthView, ReadinessView
from app.api.observability import CONTENT_TYPE, Metrics
from app.api.routing import Answer, AnyRoute, Call, NoQuery, Route, tagged
from app.api.services import JOURNAL, ReadinessCheck
from app.services.access import Role

VERSION: Final = web.AppKey("version", str)
METRICS: Final = web.AppKey("metrics", Metrics)
CHECKS: Final[web.AppKey[Mapping[str, ReadinessCheck]]] = web.AppKey("checks")


async def health(call: Call[NoQuery, Empty]) -> web.Response:
    return json_answer(HealthView(status="ok", version=call.request.app[VERSION]))


async def readiness(call: Call[NoQuery, Empty]) -> web.Response:
    """GET /readyz: 503 with the reasons while the service cannot accept plans or commands."""
    found = {name: check() for name, check in call.request.app[CHECKS].items()}
    if not call.request.app[JOURNAL].healthy:
        found["journal"] = "the last write failed; no event can be recorded"
    reasons = {name: reason for name, reason in found.items() if reason is not None}
    return json_answer(ReadinessView(ready=not reasons, reasons=reasons), status=503 if reasons else 200)


async def metrics(call: Call[NoQuery, Empty]) -> web.Response:
    body = call.request.app[METRICS].exposition()
    return web.Response(body=body, headers={"Content-Type": CONTENT_TYPE})


ROUTES: tuple[AnyRoute, ...] = tagged(
    "operation",
    Route(
        method="GET",
        path="/healthz",
        handler=health,
        summary="Liveness check",
        role=None,
        answers=(Answer(200, "The process is alive", HealthView),),
    ),
    Route(
        method="GET",
        path="/readyz",
        handler=readiness,
        summary="Readiness check; lists the parts that are not ready",
        role=None,
        answers=(Answer(200, "Ready", ReadinessView), Answer(503, "Not ready", ReadinessView)),
    ),
    Route(
        method="GET",
        path="/metrics",
        handler=metrics,
        summary="Get Prometheus metrics",
        role=Role.VIEWER,
        answers=(Answer(200, "Text exposition format", media="text/plain", schema={"type": "string"}),),
    ),
)
