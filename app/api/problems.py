"""All problem responses: HTTP status and title of each code, as application/problem+json (RFC 9457).

No other module maps errors to responses. Codes are stable: clients may depend on them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
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

# The stable codes of all errors, with HTTP status and title. Served at /api/v1/problems.


@dataclass(frozen=True, slots=True)
class ProblemKind:
    """A kind of problem. `retry_after_s` is set if the client should retry."""

    code: str
    status: int
    title: str
    retry_after_s: int | None = None


_KINDS: Final = (
    ProblemKind("request.not_http", 400, "Malformed HTTP request"),
    ProblemKind("request.malformed", 400, "Malformed JSON"),
    ProblemKind("request.invalid", 422, "Request body validation failed"),
    ProblemKind("request.query_invalid", 400, "Invalid query parameter"),
    ProblemKind("request.content_type", 415, "Unsupported media type"),
    ProblemKind("request.too_large", 413, "Request body too large"),
    ProblemKind("request.body_memory_full", 503, "Too many large request bodies in progress", retry_after_s=5),
    ProblemKind("request.timeout", 408, "Request timed out"),
    ProblemKind("request.expectation", 417, "Expectation failed"),
    ProblemKind("path.not_found", 404, "Path not found"),
    ProblemKind("method.not_allowed", 405, "Method not allowed"),
    ProblemKind("host.not_allowed", 421, "Host not allowed"),
    ProblemKind("origin.not_allowed", 403, "Origin not allowed"),
    ProblemKind("auth.required", 401, "Authentication required"),
    ProblemKind("auth.invalid", 401, "Invalid token"),
    ProblemKind("auth.too_many_attempts", 429, "Too many failed authentications"),
    ProblemKind("role.insufficient", 403, "Insufficient role"),
    ProblemKind("idempotency.key_invalid", 400, "Invalid Idempotency-Key"),
    ProblemKind("idempotency.key_reused", 422, "Idempotency-Key reused with a different request"),
    ProblemKind("idempotency.outcome_unknown", 409, "Outcome of the first request unknown", retry_after_s=5),
    ProblemKind("connection.limit_reached", 503, "Connection limit reached", retry_after_s=5),
    ProblemKind("stream.upgrade_required", 426, "WebSocket upgrade required"),
    ProblemKind("stream.subprotocol", 400, "Unsupported WebSocket subprotocol"),
    ProblemKind("stream.limit_reached", 503, "WebSocket limit reached", retry_after_s=5),
    ProblemKind("stream.token_limit_reached", 429, "WebSocket limit of this token reached", retry_after_s=5),
    ProblemKind("plan.invalid", 422, "Plan validation failed"),
    ProblemKind("plan.rejected", 422, "Plan rejected"),
    ProblemKind("conversion.refused", 422, "Conversion failed"),
    ProblemKind("input.invalid", 422, "Invalid document"),
    ProblemKind("resource.not_found", 404, "Resource not found"),
    ProblemKind("state.conflict", 409, "Conflict with the current state"),
    ProblemKind("vehicle.busy", 409, "Vehicle busy with a run"),
    ProblemKind("vehicle.taken", 409, "Vehicle controlled by another client"),
    ProblemKind("vehicle.quarantined", 409, "Vehicle quarantined"),
    ProblemKind("vehicle.refused", 409, "Command rejected by the vehicle"),
    ProblemKind("run.wrong_state", 409, "Command not allowed in the current run state"),
    ProblemKind("run.drop_in_progress", 409, "Drop in progress"),
    ProblemKind("run.hold_required", 409, "Vehicle must hold first"),
    ProblemKind("run.changing", 409, "Mission change in progress"),
    ProblemKind("run.not_over", 409, "Run not finished"),
    ProblemKind("run.no_remaining_items", 409, "No items left to fly"),
    ProblemKind("run.continued", 409, "Run already continued"),
    ProblemKind("run.divert_refused", 409, "Divert not possible"),
    ProblemKind("job.wrong_state", 409, "Command not allowed in the current job state"),
    ProblemKind("job.queue_full", 409, "Job queue full"),
    ProblemKind("drop.consent_not_asked", 409, "No consent request pending"),
    ProblemKind("drop.consent_too_late", 409, "Consent request expired"),
    ProblemKind("drop.consent_answered", 409, "Consent request already answered"),
    ProblemKind("webhook.secret_lost", 409, "Webhook secret cannot be decrypted"),
    ProblemKind("setpoint.refused", 422, "Setpoint rejected"),
    ProblemKind("task.refused", 422, "Task rejected"),
    ProblemKind("task.queue_full", 409, "Task queue full"),
    ProblemKind("task.active", 409, "Task already started"),
    ProblemKind("offboard.lease_held", 409, "Lease held by another client"),
    ProblemKind("offboard.lease_lost", 409, "Lease not held"),
    ProblemKind("offboard.not_ready", 409, "Offboard control not available"),
    ProblemKind("offboard.audit_failed", 409, "Vehicle parameters unsafe for offboard control"),
    ProblemKind("command.expired", 504, "Command expired"),
    ProblemKind("vehicle.link", 502, "Vehicle link failed"),
    ProblemKind("mission.upload_failed", 502, "Mission upload failed"),
    ProblemKind("vehicle.timeout", 504, "Vehicle did not respond"),
    ProblemKind("link_key.unusable", 409, "Link signing keys cannot be used"),
    ProblemKind("simulator.not_running", 404, "Simulator not found"),
    ProblemKind("simulator.refused", 409, "Command rejected by the simulator"),
    ProblemKind("simulator.no_answer", 504, "Simulator did not respond"),
    ProblemKind("attachment.quota_exceeded", 507, "Attachment storage quota exceeded"),
    ProblemKind("attachment.altered", 410, "Attached file missing or altered"),
    ProblemKind("cluster.bus_down", 503, "Gateways not reachable", retry_after_s=5),
    ProblemKind("cluster.call_refused", 502, "Call refused by the gateway"),
    ProblemKind("gateway.unreachable", 503, "Gateway not reachable", retry_after_s=5),
    ProblemKind("gateway.no_reply", 504, "Outcome unknown"),
    ProblemKind("gateway.elsewhere", 421, "Available on the vehicle's gateway only"),
    ProblemKind("storage.failed", 503, "Journal not writable", retry_after_s=5),
    ProblemKind("service.internal_error", 500, "Internal server error"),
)

PROBLEMS: Final[dict[str, ProblemKind]] = {kind.code: kind for kind in _KINDS}


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
            return ProblemKind(error.code, near.status, near.title)
    return ProblemKind(error.code, 500, PROBLEMS["service.internal_error"].title)


def status_of(code: str, otherwise: int) -> int:
    """The HTTP status of a code of the table."""
    return otherwise if code not in PROBLEMS else PROBLEMS[code].status


def problem_response(error: errors.WaydropError, *, request_id: str) -> web.Response:
    """Return the response for an expected error."""
    kind = kind_of(error)
    headers = error.headers if isinstance(error, ApiError) else {}
    retry_after_s = error.extra.get("retry_after_s", kind.retry_after_s)
    if retry_after_s is not None:
        headers = {"Retry-After": str(retry_after_s), **headers}
    return _response(kind, error.detail, hint=error.hint, request_id=request_id, extra=error.extra, headers=headers)


def http_problem(error: web.HTTPException, *, request_id: str) -> web.Response:
    """Return the response for an error of aiohttp: unknown path, wrong method, body too large."""
    known = PROBLEMS.get(_HTTP_CODES.get(error.status, ""))
    kind = known or ProblemKind(f"http.{error.status}", error.status, error.reason or "HTTP error")
    headers = {"Allow": error.headers["Allow"]} if "Allow" in error.headers else {}
    return _response(kind, kind.title, hint="", request_id=request_id, extra={}, headers=headers)


def internal_problem(*, request_id: str) -> web.Response:
    """Return the response for a bug. Details are in the log, under the request's ID, and never in the response."""
    detail = f"an unexpected error occurred; the log has details under incident {request_id}"
    return _response(PROBLEMS["service.internal_error"], detail, hint="", request_id=request_id, extra={}, headers={})


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
    *,
    hint: str,
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
        "hint": hint,
        "request_id": request_id,
    }
    body = to_json(_unicode(document), inf_nan_mode="null", fallback=str)
    return web.Response(body=body, status=kind.status, content_type=CONTENT_TYPE, headers=dict(headers))


# Converts all exceptions to problem responses. Unexpected ones are logged with their traceback.


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
