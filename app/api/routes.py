"""The table of all routes."""

from __future__ import annotations

from typing import Final

from app.api import (
    attachments,
    comparisons,
    consents,
    documents,
    events,
    health,
    job_queues,
    jobs,
    offboard,
    plan_checks,
    plan_conversions,
    plan_exports,
    plans,
    principal,
    proofs,
    run_changes,
    runs,
    schemas,
    simulator,
    targets,
    tasks,
    vehicles,
    webhooks,
)
from app.api.routing import AnyRoute

ROUTES: Final[tuple[AnyRoute, ...]] = (
    *vehicles.ROUTES,
    *offboard.ROUTES,
    *tasks.ROUTES,
    *plans.ROUTES,
    *plan_exports.ROUTES,
    *plan_checks.ROUTES,
    *plan_conversions.ROUTES,
    *runs.ROUTES,
    *run_changes.ROUTES,
    *targets.ROUTES,
    *jobs.ROUTES,
    *job_queues.ROUTES,
    *comparisons.ROUTES,
    *consents.ROUTES,
    *proofs.ROUTES,
    *attachments.ROUTES,
    *events.ROUTES,
    *webhooks.ROUTES,
    *simulator.ROUTES,
    *principal.ROUTES,
    *schemas.ROUTES,
    *documents.ROUTES,
    *health.ROUTES,
)
