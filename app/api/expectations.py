"""The Expect header: `100-continue` is met, anything else refused."""

from __future__ import annotations

import secrets

from aiohttp import web

from app.api.problems import ApiError, problem_response


async def meet_expectation(request: web.Request) -> web.StreamResponse | None:
    """aiohttp calls this before all middlewares. An answer ends the request."""
    expected = request.headers.get("Expect", "")
    if expected.strip().lower() != "100-continue":
        error = ApiError("request.expectation", "only Expect: 100-continue is understood")
        return problem_response(error, request_id=secrets.token_hex(8))
    if request.version >= (1, 1):
        await request.writer.write(b"HTTP/1.1 100 Continue\r\n\r\n")
        request.writer.output_size = 0  # so that the answer proper still gets its headers
    return None
