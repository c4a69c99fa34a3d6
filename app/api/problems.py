"""All problem responses: HTTP status and title of each code, as application/problem+json (RFC 9457).

No other module maps errors to responses. Codes are stable: clients may depend on them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Any, Final

import structlog
from aiohttp import web
from aiohttp.typedefs import Handler
from pydantic import BaseModel, ConfigDict
from pydantic_core import to_json

from app.api.observability import note_code, request_id, route_of
from app.domain import errors
from app.domain.errors import WaydropError
from app.domain.validation.finding import Finding


@dataclass(frozen=True, slots=True)
class ProblemKind:
    """A kind of problem. `hint` is for errors that give none. `retry_after_s` is set if the client should retry."""

    code: str
    status: int
    title: str
    hint: str
    retry_after_s: int | None = None


SEE_DOCS: Final = "see the paths at /api/v1/docs"
# code, status, title, hint, and after how many seconds to retry
_KINDS: Final[tuple[tuple[str, int, str, str] | tuple[str, int, str, str, int], ...]] = (
    ("request.not_http", 400, "Malformed HTTP request", "send HTTP/1.1"),
    ("request.malformed", 400, "Malformed request body", "send one complete JSON document"),
    ("request.invalid", 422, "Request body validation failed", "correct the fields that the findings point at"),
    ("request.query_invalid", 400, "Invalid query parameter", "see the parameters of this path at /api/v1/docs"),
    ("request.content_type", 415, "Unsupported media type", "see the content types of this path at /api/v1/docs"),
    ("request.too_large", 413, "Request body too large", "send a smaller body"),
    ("request.body_memory_full", 503, "Too many large request bodies in progress", "try again in a few seconds", 5),
    ("request.timeout", 408, "Request timed out", "send the whole body without a pause"),
    ("request.expectation", 417, "Expectation failed", "send no Expect header"),
    ("path.not_found", 404, "Path not found", SEE_DOCS),
    ("method.not_allowed", 405, "Method not allowed", "use a method of the Allow header"),
    ("host.not_allowed", 421, "Host not allowed", "add the name to WAYDROP_ALLOWED_HOSTS"),
    ("origin.not_allowed", 403, "Origin not allowed", "add the origin to WAYDROP_ALLOWED_ORIGINS"),
    ("auth.required", 401, "Authentication required", "send a token as `Authorization: Bearer TOKEN`"),
    ("auth.invalid", 401, "Invalid token", "ask an administrator for a valid token"),
    ("auth.too_many_attempts", 429, "Too many failed authentications", "wait as long as Retry-After says"),
    ("role.insufficient", 403, "Insufficient role", "use a token with the required role"),
    ("idempotency.key_invalid", 400, "Invalid Idempotency-Key", "send 1 to 200 visible ASCII characters"),
    ("idempotency.key_reused", 422, "Idempotency-Key reused with a different request", "use a new key"),
    ("idempotency.outcome_unknown", 409, "Outcome of the first request unknown", "read the current state first", 5),
    ("connection.limit_reached", 503, "Connection limit reached", "close unused connections", 5),
    ("stream.upgrade_required", 426, "WebSocket upgrade required", "open this address as a websocket"),
    ("stream.subprotocol", 400, "Unsupported WebSocket subprotocol", "offer the subprotocol that the detail names"),
    ("stream.limit_reached", 503, "WebSocket limit reached", "close unused websockets", 5),
    ("stream.token_limit_reached", 429, "WebSocket limit of this token reached", "close unused websockets", 5),
    ("plan.invalid", 422, "Plan validation failed", "correct the fields that the findings point at"),
    ("plan.rejected", 422, "Plan rejected", "check the plan, and correct what the check finds"),
    ("plan.work_timeout", 503, "Plan or file took too long", "make it smaller: fewer items, corners or circles"),
    ("conversion.refused", 422, "Conversion failed", "correct what the findings point at, or use another format"),
    ("input.invalid", 422, "Invalid document", "correct what the detail names"),
    ("resource.not_found", 404, "Resource not found", "list the resources to see their IDs"),
    ("state.conflict", 409, "Conflict with the current state", "read the current state, then decide again"),
    ("vehicle.busy", 409, "Vehicle busy with a run", "wait until its run is over"),
    ("vehicle.taken", 409, "Vehicle controlled by another client", "ask whoever controls it to release it"),
    (
        "vehicle.in_failsafe",
        409,
        "Failsafe active",
        "wait until the failsafe acts, at most 8 s, or command return or land",
    ),
    ("vehicle.quarantined", 409, "Vehicle quarantined", "give each vehicle its own system id"),
    ("vehicle.refused", 409, "Command rejected by the vehicle", "see the vehicle's messages in the events"),
    ("run.wrong_state", 409, "Command not allowed in the current run state", "read the run to see its state"),
    ("run.not_followed", 409, "Run not followed", "command the vehicle itself: its hold, return and land are sent"),
    ("run.drop_in_progress", 409, "Drop in progress", "wait until the drop is over"),
    ("run.hold_required", 409, "Vehicle must hold first", "pause the run first"),
    ("run.changing", 409, "Mission change in progress", "wait until the change is over, then read the run"),
    ("run.not_over", 409, "Run not finished", "wait until the run is over"),
    ("run.no_remaining_items", 409, "No items left to fly", "start a new run of the plan"),
    ("run.continued", 409, "Run already continued", "see the run that continues it"),
    ("run.divert_refused", 409, "Divert not possible", "return or land instead"),
    ("job.wrong_state", 409, "Command not allowed in the current job state", "read the job to see its state"),
    ("job.not_taken", 409, "Job not taken by the gateway", "read the job to see what becomes of it"),
    ("job.queue_full", 409, "Job queue full", "cancel a job, or wait until one has begun"),
    ("drop.consent_not_asked", 409, "No consent request pending", "read the run to see what it waits for"),
    ("drop.consent_too_late", 409, "Consent request expired", "read the run to see how the drop ended"),
    ("drop.consent_answered", 409, "Consent request already answered", "read the run to see how the drop ends"),
    ("webhook.secret_lost", 409, "Webhook secret cannot be decrypted", "restore the key file, or create it again"),
    ("setpoint.refused", 422, "Setpoint rejected", "see the vehicle's capabilities and limits"),
    ("task.refused", 422, "Task rejected", "see the vehicle's capabilities and limits, then change the task"),
    ("task.queue_full", 409, "Task queue full", "remove a task first"),
    ("task.active", 409, "Task already started", "skip it, and add another one"),
    ("offboard.lease_held", 409, "Lease held by another client", "wait until it is released or expires"),
    ("offboard.lease_lost", 409, "Lease not held", "acquire the lease again"),
    ("offboard.not_ready", 409, "Offboard control not available", "wait a moment, then read the vehicle's state"),
    ("offboard.audit_failed", 409, "Vehicle parameters unsafe for offboard control", "correct the listed parameters"),
    ("command.expired", 504, "Command expired", "check the vehicle's link, then try again"),
    ("vehicle.link", 502, "Vehicle link failed", "check the vehicle's link and state, then try again"),
    ("mission.upload_failed", 502, "Mission upload failed", "check the vehicle's link, then upload again"),
    ("vehicle.timeout", 504, "Vehicle did not respond", "check the vehicle's link, then try again"),
    ("link_key.unusable", 409, "Link signing keys cannot be used", "correct the key file that the detail names"),
    ("simulator.not_running", 404, "Simulator not found", "start Waydrop with `waydrop up`"),
    ("simulator.refused", 409, "Command rejected by the simulator", "choose a vehicle and a fault of the simulator"),
    ("simulator.no_answer", 504, "Simulator did not respond", "check that the simulator runs, then try again"),
    ("events.pruned", 410, "Events deleted by age", "continue with after=0, the oldest event that is kept"),
    ("attachment.quota_exceeded", 507, "Attachment storage quota exceeded", "raise the quota, or delete old data"),
    ("attachment.expired", 410, "Attached file deleted by age", "set a longer WAYDROP_ATTACHMENTS_RETENTION_DAYS"),
    ("attachment.altered", 410, "Attached file missing or altered", "restore the file from a backup"),
    ("cluster.bus_down", 503, "Gateways not reachable", "check that NATS runs; the gateways fly on", 5),
    ("cluster.call_refused", 502, "Call refused by the gateway", "give all parts one version and one key"),
    ("cluster.site_taken", 409, "Another gateway has this site", "give each gateway its own WAYDROP_SITE"),
    ("cluster.site_undecided", 503, "Holder of the site not known yet", "wait a few seconds", 5),
    ("gateway.unreachable", 503, "Gateway not reachable", "check that it runs and reaches NATS", 5),
    ("gateway.no_reply", 504, "Outcome unknown", "read the current state before you try again"),
    ("gateway.elsewhere", 421, "Available on the vehicle's gateway only", "send the request to the vehicle's gateway"),
    ("storage.failed", 503, "Storage not available", "check the disk of the data directory, or PostgreSQL", 5),
    ("service.internal_error", 500, "Internal server error", "report it with the incident of the log"),
)

PROBLEMS: Final = {row[0]: ProblemKind(*row) for row in _KINDS}


CONTENT_TYPE: Final = "application/problem+json"
TYPE_PREFIX: Final = "/api/v1/problems#"

_BY_CLASS: Final[dict[type[errors.WaydropError], str]] = {
    errors.NotFoundError: "resource.not_found",
    errors.ConflictError: "state.conflict",
    errors.InvalidInputError: "input.invalid",
    errors.PlanRejectedError: "plan.rejected",
    errors.LinkTimeoutError: "vehicle.timeout",
    errors.VehicleRefusedError: "vehicle.refused",
    errors.LinkError: "vehicle.link",
    errors.StorageError: "storage.failed",
}
"""The fallback for an error whose code is not in the table: the code of its nearest base class."""

_HTTP_CODES: Final[dict[int, str]] = {
    400: "request.not_http",
    404: "path.not_found",
    405: "method.not_allowed",
    413: "request.too_large",
    417: "request.expectation",
}


class Problem(BaseModel):
    """An error. `code` is stable and for programs; `title`, `detail` and `hint` are for people; `request_id` identifies
    the log entry.
    """

    model_config = ConfigDict(extra="allow")

    type: str
    title: str
    status: int
    detail: str
    code: str
    hint: str = ""
    request_id: str = ""
    findings: list[Finding] | None = None


class ApiError(errors.WaydropError):
    """An error of the request itself. `code` is a code of the table; `headers` are added to the response."""

    def __init__(
        self, code: str, detail: str, *, hint: str = "", headers: Mapping[str, str] | None = None, **extra: object
    ) -> None:
        super().__init__(detail, hint=hint, **extra)
        self.code = code
        self.headers = dict(headers or {})


def kind_of(error: errors.WaydropError) -> ProblemKind:
    """Return status and title of an error. Its own code is kept."""
    known = PROBLEMS.get(error.code)
    if known is not None:
        return known
    for cls in type(error).__mro__:
        if cls in _BY_CLASS:
            near = PROBLEMS[_BY_CLASS[cls]]
            return ProblemKind(error.code, near.status, near.title, near.hint)
    return replace(PROBLEMS["service.internal_error"], code=error.code)


def status_of(code: str, otherwise: int) -> int:
    """The HTTP status of a code of the table."""
    return otherwise if code not in PROBLEMS else PROBLEMS[code].status


def problem_response(error: errors.WaydropError, *, request_id: str) -> web.Response:
    kind = kind_of(error)
    headers = error.headers if isinstance(error, ApiError) else {}
    retry_after_s = error.extra.get("retry_after_s", kind.retry_after_s)
    if retry_after_s is not None:
        headers = {"Retry-After": str(retry_after_s), **headers}
    return _response(kind, error.detail, error.hint, request_id=request_id, extra=error.extra, headers=headers)


def http_problem(error: web.HTTPException, *, request_id: str) -> web.Response:
    """Return the response for an error of aiohttp: unknown path, wrong method, body too large."""
    known = PROBLEMS.get(_HTTP_CODES.get(error.status, ""))
    kind = known or ProblemKind(f"http.{error.status}", error.status, error.reason or "HTTP error", SEE_DOCS)
    headers = {"Allow": error.headers["Allow"]} if "Allow" in error.headers else {}
    return _response(kind, kind.title, request_id=request_id, extra={}, headers=headers)


def internal_problem(*, request_id: str) -> web.Response:
    """Return the response for a bug. Details are in the log, under the request's ID, and never in the response."""
    detail = f"an unexpected error occurred; the log has details under incident {request_id}"
    return _response(PROBLEMS["service.internal_error"], detail, request_id=request_id, extra={}, headers={})


def _unicode(node: Any) -> Any:
    """Replace lone surrogates: quoted headers may contain any bytes."""
    if isinstance(node, str):
        return node.encode("utf-8", "backslashreplace").decode()
    if isinstance(node, Mapping):
        return {_unicode(key): _unicode(value) for key, value in node.items()}
    return [_unicode(value) for value in node] if isinstance(node, list | tuple) else node


def _response(
    kind: ProblemKind,
    detail: str,
    hint: str = "",
    *,
    request_id: str,
    extra: Mapping[str, object],
    headers: Mapping[str, str],
) -> web.Response:
    document: dict[str, Any] = {
        **{key: value for key, value in extra.items() if key not in Problem.model_fields or key == "findings"},
        "type": TYPE_PREFIX + kind.code,
        "title": kind.title,
        "status": kind.status,
        "detail": detail,
        "code": kind.code,
        "hint": hint or kind.hint,
        "request_id": request_id,
    }
    body = to_json(_unicode(document), inf_nan_mode="null", fallback=str)
    return web.Response(body=body, status=kind.status, content_type=CONTENT_TYPE, headers=dict(headers))


log = structlog.get_logger(__name__)


class Boundary:
    """Catches every exception except cancellation. `problem` is then the response."""

    def __init__(self, request: web.Request) -> None:
        self._request = request
        self.problem: web.Response | None = None

    def __enter__(self) -> Boundary:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> bool:
        identity = request_id(self._request)
        if isinstance(error, WaydropError):
            self.problem = problem_response(error, request_id=identity)
            note_code(self._request, error.code)
        elif isinstance(error, web.HTTPException):
            self.problem = http_problem(error, request_id=identity)
            note_code(self._request, _HTTP_CODES.get(error.status, f"http.{error.status}"))
        elif isinstance(error, ConnectionError) and _is_gone(self._request):
            self.problem = web.Response(status=499, reason="Client Closed Request")  # for the log only
        elif isinstance(error, Exception):
            log.error("defect", incident=identity, route=route_of(self._request), exc_info=error)
            self.problem = internal_problem(request_id=identity)
            note_code(self._request, "service.internal_error")
        return self.problem is not None


@web.middleware
async def answer_problems(request: web.Request, handler: Handler) -> web.StreamResponse:
    """Convert exceptions to problem responses."""
    with Boundary(request) as boundary:
        return await handler(request)
    if boundary.problem is None:  # the block either returns or sets a problem
        raise AssertionError("an error without a response")
    return boundary.problem


def _is_gone(request: web.Request) -> bool:
    return request.transport is None or request.transport.is_closing()
