"""/audit, and the middleware that records who did what and what was refused."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Annotated, Final

from aiohttp import web
from aiohttp.typedefs import Handler, Middleware
from pydantic import BaseModel, Field

from app.api.bodies import JSON, NUL, Empty, asked_of, json_answer
from app.api.guard import SAFE_METHODS
from app.api.idempotency import REPLAYED
from app.api.models import Time
from app.api.observability import code_of, principal_of, route_of
from app.api.problems import kind_of, status_of
from app.api.routing import Answer, Call, Route, Routes
from app.api.runs import CSV, spreadsheet_cell
from app.domain.audit import AuditEntry, AuditFilter, AuditOutcome
from app.domain.errors import RefusalError, WaydropError
from app.domain.model import FrozenForm
from app.services.access import Principal, Role
from app.services.audit import Audit

ROUTES: Final = Routes("access")

ACCESS_CODES: Final = frozenset({"role.insufficient", "host.not_allowed", "origin.not_allowed"})
"""Besides auth.*: recorded of requests that only read, too."""

CURSOR_CHARS: Final = 64


def audited(audit: Audit, routes: Sequence[Route]) -> Middleware:
    """Record actions that were carried out, rejected actions, and everything that was rejected for want of access."""
    rows: dict[tuple[str, str], Route] = {(route.method, route.path): route for route in routes}

    @web.middleware
    async def middleware(request: web.Request, handler: Handler) -> web.StreamResponse:
        response = await handler(request)
        route, code, principal = rows.get((request.method, route_of(request))), code_of(request), principal_of(request)
        if code is not None:
            if _is_of_interest(request, route, code):
                action = f"{request.method} {route_of(request)}" if route is None else route.name
                status = status_of(code, response.status)
                audit.refuse(principal, request.remote or "", action, _target(request), status, code)
        elif route is not None and route.is_action and principal is not None and REPLAYED not in response.headers:
            await audit.accept(principal, route.name, _target(request))
        return response

    return middleware


def _target(request: web.Request) -> str:
    return request.path.replace(NUL, "%00")


def _is_of_interest(request: web.Request, route: Route | None, code: str) -> bool:
    if code in ACCESS_CODES or code.startswith("auth."):
        return True
    return request.method not in SAFE_METHODS if route is None else route.is_action


class FrameAudit:
    """The audit of one websocket's frames."""

    def __init__(self, audit: Audit, principal: Principal, request: web.Request) -> None:
        self._audit = audit
        self._principal = principal
        self._address = request.remote or ""
        self._target = _target(request)

    def accept(self, action: str) -> None:
        """A frame was carried out."""
        self._audit.accept_soon(self._principal, action, self._target)

    def refuse(self, action: str, error: WaydropError) -> None:
        """A frame was rejected."""
        code = error.refusal if isinstance(error, RefusalError) else error.code
        self._audit.refuse(self._principal, self._address, action, self._target, kind_of(error).status, code)


class AuditQuery(FrozenForm):
    """Filters for the audit. `cursor`: the page after another one, taken from its `next`."""

    actor: Annotated[str, Field(max_length=200)] | None = None
    outcome: AuditOutcome | None = None
    since: Time | None = None
    before: Time | None = None
    limit: Annotated[int, Field(ge=1, le=1000)] = 100
    cursor: Annotated[str, Field(max_length=CURSOR_CHARS)] | None = None

    def wanted(self) -> AuditFilter:
        """Convert to the query of the service."""
        return AuditFilter(
            actor=self.actor,
            outcome=self.outcome,
            since=None if self.since is None else self.since.timestamp(),
            before=None if self.before is None else self.before.timestamp(),
        )


class AuditListView(BaseModel):
    """Audit entries, newest first. Pass `next` as `cursor` to get the next page; it is null on the last page."""

    entries: list[AuditEntry]
    next: str | None = None


_COLUMNS: Final = (
    *("time", "actor", "token_id", "address", "action", "target", "outcome", "status", "code", "count", "seq"),
)


def audit_csv(entries: Sequence[AuditEntry]) -> str:
    """One CSV row per entry (RFC 4180), times in UTC. Values that look like formulas are prefixed with '."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerow(_COLUMNS)
    for entry in entries:
        row = entry.model_dump(mode="json")
        row["time"] = datetime.fromtimestamp(entry.time, UTC).isoformat(timespec="milliseconds")
        writer.writerow([spreadsheet_cell(row[column]) for column in _COLUMNS])
    return out.getvalue()


@ROUTES.route(
    "GET",
    "/audit",
    Role.ADMIN,
    Answer(200, "A page of entries", AuditListView),
    Answer(
        200,
        "The page as CSV (Accept: text/csv)",
        media=CSV,
        schema={"type": "string"},
        headers=("Link", "Content-Disposition"),
    ),
    errors=("input.invalid", "storage.failed"),
)
async def list_audit(call: Call[AuditQuery, Empty]) -> web.Response:
    """List who did what and what was refused, newest first."""
    query = call.query
    entries, following = await call.services.audit.page(query.wanted(), limit=query.limit, cursor=query.cursor)
    if asked_of(call.request, JSON, CSV) == JSON:
        return json_answer(AuditListView(entries=entries, next=following), headers={"Vary": "Accept"})
    headers = {"Vary": "Accept", "Content-Disposition": 'attachment; filename="audit.csv"'}
    if following is not None:
        headers["Link"] = f'<{call.request.rel_url.update_query({"cursor": following})}>; rel="next"'
    return web.Response(text=audit_csv(entries), content_type=CSV, charset="utf-8", headers=headers)
