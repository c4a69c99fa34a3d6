"""Rejects requests of foreign web pages: Host against DNS rebinding, Origin and Sec-Fetch-Site against CSRF.

A web page in a local browser can reach a loopback service that needs no token. It cannot forge these headers.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final
from urllib.parse import urlsplit

from aiohttp import web
from aiohttp.typedefs import Handler, Middleware

from app.api.problems import ApiError

LOOPBACK_HOSTS: Final = frozenset({"localhost", "127.0.0.1", "[::1]"})
SAFE_METHODS: Final = frozenset({"GET", "HEAD", "OPTIONS"})
_OWN_SITES: Final = frozenset({"same-origin", "none"})


class Guard:
    """Checks headers only. Applies to every path, including unknown ones."""

    def __init__(self, allowed_hosts: Iterable[str], allowed_origins: Iterable[str]) -> None:
        self._hosts = LOOPBACK_HOSTS | {host.lower() for host in allowed_hosts}
        self._origins = frozenset(normal_origin(origin) for origin in allowed_origins)

    def check_host(self, request: web.Request) -> None:
        """Raise ApiError unless Host is an allowed name. A page that uses DNS rebinding sends its own name."""
        hosts = request.headers.getall("Host", [])
        if len(hosts) != 1 or _without_port(hosts[0].lower()) not in self._hosts:
            raise ApiError(
                "host.not_allowed",
                f"the Host header is not allowed: {', '.join(hosts) or '(missing)'}",
                hint="use 127.0.0.1 or localhost, or add the name to WAYDROP_ALLOWED_HOSTS",
            )

    def check_origin(self, request: web.Request) -> None:
        """Raise ApiError if a page of another origin sent the request. Programs such as curl send no Origin."""
        origins = request.headers.getall("Origin", [])
        if origins:
            if len(origins) == 1 and self._is_ours(origins[0].lower(), request.headers.get("Host", "").lower()):
                return
            raise _foreign(", ".join(origins))
        site = request.headers.get("Sec-Fetch-Site")
        if site is not None and site not in _OWN_SITES:
            raise _foreign(site)

    def _is_ours(self, origin: str, host: str) -> bool:
        return origin in self._origins or origin in {f"http://{host}", f"https://{host}"}


def normal_origin(origin: str) -> str:
    """An origin as it is compared: scheme and host have no case, and people write a slash behind it."""
    return origin.lower().rstrip("/")


def is_handshake(request: web.Request) -> bool:
    """Whether the request opens a websocket: CORS does not apply to websockets."""
    return request.method == "GET" and request.headers.get("Upgrade", "").strip().lower() == "websocket"


def guarded(guard: Guard, open_paths: frozenset[str]) -> Middleware:
    """Return a middleware that checks every request. Probes may request `open_paths` with any Host."""

    @web.middleware
    async def middleware(request: web.Request, handler: Handler) -> web.StreamResponse:
        if request.path not in open_paths:
            guard.check_host(request)
        if request.method not in SAFE_METHODS or is_handshake(request):
            guard.check_origin(request)
        return await handler(request)

    return middleware


def _foreign(who: str) -> ApiError:
    return ApiError(
        "origin.not_allowed",
        f"the request was sent by a web page of another origin ({who})",
        hint="use the page that this service serves, or add the origin to WAYDROP_ALLOWED_ORIGINS",
    )


def is_loopback_host(request: web.Request) -> bool:
    """Whether Host is a loopback name. Requests through a proxy rarely have one."""
    return _without_port(request.headers.get("Host", "").lower()) in LOOPBACK_HOSTS


def _without_port(host: str) -> str:
    """Strip the port: `[::1]:8080` -> `[::1]`, `localhost:8080` -> `localhost`. Malformed values never match."""
    try:
        parts = urlsplit(f"//{host}")
        port = parts.port
    except ValueError:
        return host
    return host.removesuffix(f":{port}") if port is not None else host


API_POLICY: Final = "default-src 'none'; frame-ancestors 'none'"

PAGE_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; font-src 'self'; "
    "connect-src 'self'; worker-src 'self' blob:; manifest-src 'self'; base-uri 'self'; form-action 'none'; "
    "frame-ancestors 'none'"
)
"""No inline scripts, no other hosts. MapLibre uses blob: for its worker and images."""

DOCS_POLICY: Final = PAGE_POLICY.replace("style-src 'self'", "style-src 'self' 'unsafe-inline'")
"""Swagger UI sets style attributes."""

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
    """Signal handler for on_response_prepare. Keeps headers that a handler has set."""
    set_security_headers(response)


def set_security_headers(response: web.StreamResponse) -> None:
    """Add the security headers, and the server's name without its version."""
    for name, value in _HEADERS.items():
        response.headers.setdefault(name, value)
    response.headers["Server"] = "waydrop"
