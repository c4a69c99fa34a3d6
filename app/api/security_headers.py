"""Headers of every answer that tell a browser to trust it as little as possible."""

from __future__ import annotations

from typing import Final

from aiohttp import web

API_POLICY: Final = "default-src 'none'; frame-ancestors 'none'"

PAGE_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; font-src 'self'; "
    "connect-src 'self'; worker-src 'self' blob:; manifest-src 'self'; base-uri 'self'; form-action 'none'; "
    "frame-ancestors 'none'"
)
"""No inline script and no other host. blob: is MapLibre's worker and its images."""

DOCS_POLICY: Final = PAGE_POLICY.replace("style-src 'self'", "style-src 'self' 'unsafe-inline'")
"""Swagger UI writes style attributes."""

_HEADERS: Final = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "geolocation=(), camera=(), microphone=()",
    "Content-Security-Policy": API_POLICY,
    "Cache-Control": "no-store",
}


async def add_security_headers(_: web.Request, response: web.StreamResponse) -> None:
    """For on_response_prepare: what a handler has set itself stays."""
    set_security_headers(response)


def set_security_headers(response: web.StreamResponse) -> None:
    """The headers of every answer; and the server's name without any version."""
    for name, value in _HEADERS.items():
        response.headers.setdefault(name, value)
    response.headers["Server"] = "waydrop"
