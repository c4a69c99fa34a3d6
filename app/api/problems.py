"""Every error answer: which code has which HTTP status, and how it becomes application/problem+json (RFC 9457).

This is the only place that maps errors to answers. A code is stable: clients may decide by it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from aiohttp import web
from pydantic import BaseModel, ConfigDict
from pydantic_core import to_json

from app.api.problem_codes import PROBLEMS, ProblemKind
from app.domain import errors
from app.domain.finding import Finding

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
