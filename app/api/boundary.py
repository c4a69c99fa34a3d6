"""Where exceptions end: every one becomes a problem answer. A defect is logged with its trace, and told by its id."""

from __future__ import annotations

from types import TracebackType

import structlog
from aiohttp import web
from aiohttp.typedefs import Handler

from app.api.problems import http_problem, internal_problem, problem_response
from app.api.request_log import request_id, route_of
from app.domain.errors import WaydropError

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
