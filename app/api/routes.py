"""The table of all routes."""

from __future__ import annotations

from typing import Final

from app.api import (
    comparisons,
    documents,
    events,
    health,
    offboard,
    plan_checks,
    plan_conversions,
    plan_exports,
    plans,
    principal,
    proofs,
    runs,
    schemas,
    simulator,
    vehicles,
)
from app.api.routing import AnyRoute

ROUTES: Final[tuple[AnyRoute, ...]] = (
    *vehicles.ROUTES,
    *offboard.ROUTES,
    *plans.ROUTES,
    *plan_exports.ROUTES,
    *plan_checks.ROUTES,
    *plan_conversions.ROUTES,
    *runs.ROUTES,
    *comparisons.ROUTES,
    *proofs.ROUTES,
    *events.ROUTES,
    *simulator.ROUTES,
    *principal.ROUTES,
    *schemas.ROUTES,
    *documents.ROUTES,
    *health.ROUTES,
)
