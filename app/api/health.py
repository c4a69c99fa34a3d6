"""/healthz, /readyz and /metrics, for orchestrators and monitoring."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from aiohttp import web

from app.api.bodies import Empty, json_answer
from app.api.models import HealthView, ReadinessView
from app.api.observability import CONTENT_TYPE, Metrics
from app.api.routing import Answer, Call, NoQuery, Routes
from app.api.services import ReadinessCheck
from app.services.access import Role

ROUTES: Final = Routes("operation", prefix="")

VERSION: Final = web.AppKey("version", str)
METRICS: Final = web.AppKey("metrics", Metrics)
CHECKS: Final[web.AppKey[Mapping[str, ReadinessCheck]]] = web.AppKey("checks")


@ROUTES.route("GET", "/healthz", None, Answer(200, "The process is alive", HealthView))
async def health(call: Call[NoQuery, Empty]) -> web.Response:
    """Liveness check."""
    site_lease = None if call.services.site is None else call.services.site.claim.state
    return json_answer(HealthView(status="ok", version=call.request.app[VERSION], site_lease=site_lease))


@ROUTES.route("GET", "/readyz", None, Answer(200, "Ready", ReadinessView), Answer(503, "Not ready", ReadinessView))
async def readiness(call: Call[NoQuery, Empty]) -> web.Response:
    """Readiness check; lists the parts that are not ready.

    GET /readyz: 503 with the reasons while the service cannot accept plans or commands.
    """
    found = {name: check() for name, check in call.request.app[CHECKS].items()}
    if not call.services.journal.healthy:
        found["journal"] = "the last write failed; no event can be recorded"
    reasons = {name: reason for name, reason in found.items() if reason is not None}
    return json_answer(ReadinessView(ready=not reasons, reasons=reasons), status=503 if reasons else 200)


@ROUTES.route(
    "GET", "/metrics", Role.VIEWER, Answer(200, "Text exposition format", media="text/plain", schema={"type": "string"})
)
async def metrics(call: Call[NoQuery, Empty]) -> web.Response:
    """Get Prometheus metrics."""
    body = call.request.app[METRICS].exposition()
    return web.Response(body=body, headers={"Content-Type": CONTENT_TYPE})
