"""What aiohttp cannot read as a request never reaches the application, so it is answered here.

aiohttp would log such a request with its trace, in which its headers stand, and answer in text with its version.
"""

from __future__ import annotations

import secrets

import structlog
from aiohttp import web

from app.api.problems import http_problem, internal_problem
from app.api.security_headers import set_security_headers

log = structlog.get_logger(__name__)


class RequestProtocol(web.RequestHandler):
    """aiohttp's protocol of one connection, but for what it says of requests that are none."""

    __slots__ = ()

    def handle_error(
        self,
        request: web.BaseRequest,
        status: int = 500,
        exc: BaseException | None = None,
        message: str | None = None,
    ) -> web.StreamResponse:
        """A problem. Of a request that is none, `exc` and `message` quote what was sent: neither is told or logged."""
        if request.writer.output_size > 0:
            raise ConnectionError("an answer is on its way already")
        identity = secrets.token_hex(8)
        if status == web.HTTPBadRequest.status_code:
            log.debug("unreadable request", id=identity, client=request.remote, error=type(exc).__name__)
            answer = http_problem(web.HTTPBadRequest(), request_id=identity)
        else:
            log.error("defect", incident=identity, exc_info=exc)
            answer = internal_problem(request_id=identity)
        set_security_headers(answer)
        answer.force_close()
        return answer
