"""Authentication: a bearer token, or the local user as long as no token exists."""

from __future__ import annotations

from typing import Final

from aiohttp import web

from app.api.guard import is_loopback_host
from app.api.problems import ApiError
from app.api.proxies import is_forwarded, parsed_address
from app.services.access import Access, Principal, Role

CHALLENGE: Final = {"WWW-Authenticate": 'Bearer realm="waydrop"'}
LOCAL: Final = Principal("local", Role.ADMIN)
PUBLIC: Final = Principal("anybody", Role.VIEWER)
SUBPROTOCOL: Final = "waydrop.v1"
_TOKEN_PROTOCOL: Final = "bearer."


async def authenticate(request: web.Request, access: Access) -> Principal:
    """Authenticate a request. Raises ApiError (401)."""
    return await _principal(request, access, _bearer(request))


async def authenticate_socket(request: web.Request, access: Access) -> Principal:
    """Authenticate a websocket. Browsers cannot set headers, so the token may be a subprotocol. Raises ApiError."""
    return await _principal(request, access, _bearer(request) or _protocol_token(request))


def require_role(principal: Principal, role: Role) -> None:
    """Raise ApiError (403) unless the principal has the role."""
    if not principal.role.allows(role):
        raise ApiError(
            "role.insufficient",
            f"this operation requires the role {role.value}; {principal.name} has the role {principal.role.value}",
            hint="use a token with the required role",
        )


def is_local(request: web.Request) -> bool:
    """Whether the request was sent from this machine to a loopback name, without a proxy in between."""
    if is_forwarded(request) or not is_loopback_host(request):
        return False
    peer = request.transport.get_extra_info("peername") if request.transport is not None else None
    address = parsed_address(str(peer[0])) if peer else None
    return address is not None and address.is_loopback


async def _principal(request: web.Request, access: Access, token: str | None) -> Principal:
    if token is not None:
        principal = await access.authenticate(token, request.remote or "")
        if principal is None:
            raise ApiError("auth.invalid", "the token is unknown, expired or revoked", headers=CHALLENGE)
        return principal
    has_tokens = await access.has_tokens()
    if is_local(request) and not has_tokens:
        return LOCAL
    if is_forwarded(request) and not has_tokens:
        raise ApiError(
            "auth.required",
            "the request came through a proxy, and no access token exists: only requests from this machine itself are "
            "accepted without one",
            hint="create a token with `waydrop token create`",
            headers=CHALLENGE,
        )
    raise ApiError(
        "auth.required",
        "no token was sent",
        hint="send the header Authorization: Bearer <token>; create a token with `waydrop token create`",
        headers=CHALLENGE,
    )


def _bearer(request: web.Request) -> str | None:
    values = request.headers.getall("Authorization", [])
    if not values:
        return None
    scheme, _, token = values[0].strip().partition(" ")
    if len(values) > 1 or scheme.lower() != "bearer" or not token.strip():
        raise ApiError(
            "auth.invalid", "the Authorization header does not have the form `Bearer <token>`", headers=CHALLENGE
        )
    return token.strip()


def _protocol_token(request: web.Request) -> str | None:
    offered = request.headers.get("Sec-WebSocket-Protocol", "")
    for protocol in (part.strip() for part in offered.split(",")):
        if protocol.startswith(_TOKEN_PROTOCOL):
            return protocol.removeprefix(_TOKEN_PROTOCOL)
    return None
