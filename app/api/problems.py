"""Every error answer: which code has which HTTP status, and how it becomes application/problem+json (RFC 9457).

This is the only place that maps errors to answers. A code is stable: clients may decide by it.
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

from app.api.observability import request_id, route_of
from app.domain import errors
from app.domain.errors import WaydropError
from app.domain.validation.finding import Finding

# The stable codes of all errors, with HTTP status and title. Documented at /api/v1/problems.


@dataclass(frozen=True, slots=True)
class ProblemKind:
    """One kind of error. `retry_after_s` is told where trying again later is right."""

    code: str
    status: int
    title: str
    retry_after_s: int | None = None


_KINDS: Final = (
    ProblemKind("request.malformed", 400, "The body is not JSON"),
    ProblemKind("request.invalid", 422, "The body does not fit this request"),
    ProblemKind("request.query_invalid", 400, "A query parameter cannot be used"),
    ProblemKind("request.content_type", 415, "The body must be of a type that is taken here"),
    ProblemKind("request.too_large", 413, "The body is too large"),
    ProblemKind("request.no_room", 503, "Too many large bodies are under way", retry_after_s=5),
    ProblemKind("request.timeout", 408, "The body did not arrive in time"),
    ProblemKind("request.expectation", 417, "The Expect header cannot be met"),
    ProblemKind("path.not_found", 404, "There is nothing at this path"),
    ProblemKind("method.not_allowed", 405, "This path does not take this method"),
    ProblemKind("host.not_allowed", 421, "This service does not answer under this Host name"),
    ProblemKind("origin.not_allowed", 403, "Web pages of this origin may not do this"),
    ProblemKind("auth.required", 401, "Say who you are"),
    ProblemKind("auth.invalid", 401, "This token is not valid"),
    ProblemKind("role.insufficient", 403, "Your role does not allow this"),
    ProblemKind("idempotency.key_invalid", 400, "The Idempotency-Key cannot be used"),
    ProblemKind("idempotency.key_reused", 422, "The Idempotency-Key was used for another request"),
    ProblemKind("connections.full", 503, "Too many connections are open", retry_after_s=5),
    ProblemKind("stream.upgrade_required", 426, "This path is a websocket"),
    ProblemKind("stream.subprotocol", 400, "The websocket subprotocol is not spoken here"),
    ProblemKind("stream.full", 503, "Too many sockets are open", retry_after_s=5),
    ProblemKind("stream.token_full", 429, "This token has too many sockets open", retry_after_s=5),
    ProblemKind("plan.invalid", 422, "The document is not a plan"),
    ProblemKind("plan.rejected", 422, "The plan cannot be flown"),
    ProblemKind("conversion.refused", 422, "The document cannot become a plan"),
    ProblemKind("input.invalid", 422, "The document cannot be used"),
    ProblemKind("not_found", 404, "It does not exist"),
    ProblemKind("conflict", 409, "Not now"),
    ProblemKind("vehicle.busy", 409, "The vehicle is busy with a run"),
    ProblemKind("vehicle.taken", 409, "Somebody else has the vehicle"),
    ProblemKind("vehicle.quarantined", 409, "The vehicle is quarantined"),
    ProblemKind("vehicle.refused", 409, "The vehicle refused"),
    ProblemKind("run.wrong_state", 409, "The run is in another state"),
    ProblemKind("run.drop_in_progress", 409, "A drop is in progress"),
    ProblemKind("run.pause_first", 409, "The vehicle has to hold first"),
    ProblemKind("run.changing", 409, "The mission is being changed"),
    ProblemKind("run.not_over", 409, "The run is not over"),
    ProblemKind("run.nothing_left", 409, "Nothing is left to fly"),
    ProblemKind("run.continued", 409, "The run was continued already"),
    ProblemKind("run.rally_refused", 409, "A return goes to no rally point now"),
    ProblemKind("job.wrong_state", 409, "The job is in another state"),
    ProblemKind("jobs.full", 409, "So many jobs wait that no other is taken"),
    ProblemKind("drop.consent_not_asked", 409, "The drop asks for no consent now"),
    ProblemKind("drop.consent_too_late", 409, "The time to consent is over"),
    ProblemKind("drop.consent_answered", 409, "The other answer came first"),
    ProblemKind("setpoint.refused", 422, "The setpoint is not sent"),
    ProblemKind("tasks.refused", 422, "The task is refused"),
    ProblemKind("tasks.full", 409, "The task queue is full"),
    ProblemKind("tasks.under_way", 409, "The task is flown already"),
    ProblemKind("offboard.lease_held", 409, "Another client has the lease"),
    ProblemKind("offboard.lease_lost", 409, "The lease is not yours, or has ended"),
    ProblemKind("offboard.not_ready", 409, "Offboard control cannot begin now"),
    ProblemKind("offboard.audit_failed", 409, "The vehicle's parameters make offboard control unsafe"),
    ProblemKind("command.expired", 504, "The moment for this command is over"),
    ProblemKind("vehicle.link", 502, "The link to the vehicle failed"),
    ProblemKind("mission.upload_failed", 502, "The mission could not be uploaded"),
    ProblemKind("vehicle.timeout", 504, "The vehicle did not answer"),
    ProblemKind("simulator.not_running", 404, "No simulated vehicles are known here"),
    ProblemKind("simulator.refused", 409, "The simulator refused"),
    ProblemKind("simulator.no_answer", 504, "The simulator did not answer"),
    ProblemKind("attachments.full", 507, "There is no room for more attachments"),
    ProblemKind("attachment.altered", 410, "The file that was attached is not there any more"),
    ProblemKind("storage.failed", 503, "The journal cannot be written", retry_after_s=5),
    ProblemKind("internal", 500, "A defect of the service"),
)

PROBLEMS: Final[dict[str, ProblemKind]] = {kind.code: kind for kind in _KINDS}


CONTENT_TYPE: Final = "application/problem+json"
TYPE_PREFIX: Final = "/api/v1/problems#"

_BY_CLASS: Final[dict[type[errors.WaydropError], str]] = {
    errors.NotFoundError: "not_found",
    errors.ConflictError: "conflict",
    errors.InvalidInputError: "input.invalid",
    errors.PlanRejectedError: "plan.rejected",
    errors.LinkTimeoutError: "vehicle.timeout",
    errors.VehicleRefusedError: "vehicle.refused",
    errors.LinkError: "vehicle.link",
    errors.StorageError: "storage.failed",
}
"""An error whose own code is not in the table answers with the status of the nearest class it comes from."""

_HTTP_CODES: Final[dict[int, str]] = {
    404: "path.not_found",
    405: "method.not_allowed",
    413: "request.too_large",
    417: "request.expectation",
}


class Problem(BaseModel):
    """An error. Decide by `code`; show `title`, `detail` and `hint` to people; `request_id` finds it in the log."""

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
    """An error of the request itself. `code` is one of problem_codes; `headers` go with the answer."""

    def __init__(
        self, code: str, detail: str, *, hint: str = "", headers: Mapping[str, str] | None = None, **extra: object
    ) -> None:
        super().__init__(detail, hint=hint, **extra)
        self.code = code
        self.headers = dict(headers or {})


def kind_of(error: errors.WaydropError) -> ProblemKind:
    """Status and title of an error; its own code is kept."""
    known = PROBLEMS.get(error.code)
    if known is not None:
        return known
    for cls in type(error).__mro__:
        if cls in _BY_CLASS:
            near = PROBLEMS[_BY_CLASS[cls]]
            return ProblemKind(error.code, near.status, near.title)
    return ProblemKind(error.code, 500, PROBLEMS["internal"].title)


def problem_response(error: errors.WaydropError, *, request_id: str) -> web.Response:
    """The answer to an expected error."""
    kind = kind_of(error)
    headers = error.headers if isinstance(error, ApiError) else {}
    if kind.retry_after_s is not None:
        headers = {"Retry-After": str(kind.retry_after_s), **headers}
    return _response(kind, error.detail, hint=error.hint, request_id=request_id, extra=error.extra, headers=headers)


def http_problem(error: web.HTTPException, *, request_id: str) -> web.Response:
    """The answer to what aiohttp itself refused: unknown path, wrong method, too large a body."""
    known = PROBLEMS.get(_HTTP_CODES.get(error.status, ""))
    kind = known or ProblemKind(f"http.{error.status}", error.status, error.reason or "HTTP error")
    headers = {"Allow": error.headers["Allow"]} if "Allow" in error.headers else {}
    return _response(kind, kind.title, hint="", request_id=request_id, extra={}, headers=headers)


def internal_problem(*, request_id: str) -> web.Response:
    """The answer to a defect of ours: what happened is in the log under the request's id, never in the answer."""
    detail = f"this is a defect of the service; the log has it as incident {request_id}"
    return _response(PROBLEMS["internal"], detail, hint="", request_id=request_id, extra={}, headers={})


def _unicode(node: Any) -> Any:
    """The same without lone surrogates: what is told of a header may hold any bytes."""
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


# Where exceptions end: every one becomes a problem answer. A defect is logged with its trace, and told by its id.


log = structlog.get_logger(__name__)


class Boundary:
    """A block out of which no exception comes: afterwards `problem` is its answer. Cancellation passes."""

    def __init__(self, request: web.Request) -> None:
        self._request = request
        self.problem: web.Response | None = None

    def __enter__(self) -> Boundary:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> bool:
        identity = request_id(self._request)
        if isinstance(error, WaydropError):
            self.problem = problem_response(error, request_id=identity)
        elif isinstance(error, web.HTTPException):
            self.problem = http_problem(error, request_id=identity)
        elif isinstance(error, ConnectionError) and _is_gone(self._request):
            self.problem = web.Response(status=499, reason="Client Closed Request")  # for the log: nobody reads it
        elif isinstance(error, Exception):
            log.error("defect", incident=identity, route=route_of(self._request), exc_info=error)
            self.problem = internal_problem(request_id=identity)
        return self.problem is not None


@web.middleware
async def answer_problems(request: web.Request, handler: Handler) -> web.StreamResponse:
    """Turns what is raised further in into answers."""
    with Boundary(request) as boundary:
        return await handler(request)
    if boundary.problem is None:  # the block either returns or leaves a problem
        raise AssertionError("an error without an answer")
    return boundary.problem


def _is_gone(request: web.Request) -> bool:
    return request.transport is None or request.transport.is_closing()
