"""Requests through proxies: whose address counts, and which requests were passed on."""

from __future__ import annotations

import ipaddress
from collections.abc import Sequence
from typing import Final

from aiohttp import web
from aiohttp.typedefs import Handler, Middleware

Network = ipaddress.IPv4Network | ipaddress.IPv6Network
Address = ipaddress.IPv4Address | ipaddress.IPv6Address

FORWARDED_FOR: Final = "X-Forwarded-For"
_SIGNS: Final = frozenset({"forwarded", "via", "x-real-ip", "x-client-ip", "true-client-ip", "cf-connecting-ip"})


def is_forwarded(request: web.Request) -> bool:
    """Whether a header says that a proxy passed the request on."""
    names = (name.lower() for name in request.headers)
    return any(name in _SIGNS or name.startswith("x-forwarded") for name in names)


def parsed_address(text: str) -> Address | None:
    """An IP address without its zone; an IPv4 address within IPv6 as IPv4. None for anything else."""
    try:
        address = ipaddress.ip_address(text.strip().partition("%")[0])
    except ValueError:
        return None
    if isinstance(address, ipaddress.IPv6Address) and address.ipv4_mapped is not None:
        return address.ipv4_mapped
    return address


class TrustedProxies:
    """The addresses whose X-Forwarded-For is trusted."""

    def __init__(self, networks: Sequence[Network]) -> None:
        self._networks = tuple(networks)

    def contains(self, text: str) -> bool:
        """Whether an address is a named one."""
        address = parsed_address(text) if self._networks else None
        return address is not None and any(
            address.version == network.version and address in network for network in self._networks
        )

    def client_of(self, peer: str, forwarded_for: Sequence[str]) -> str:
        """The address of the client: the last one that is not a trusted proxy.

        `forwarded_for` are the values of the header, in order. Each proxy appends the address of its client, so
        everything before the first untrusted address, from the end, may be forged.
        """
        client = peer
        chain = [part.strip() for value in forwarded_for for part in value.split(",")]
        while self.contains(client) and chain:
            address = parsed_address(chain.pop())
            if address is None:
                break
            client = str(address)
        return client


def behind_proxies(proxies: TrustedProxies) -> Middleware:
    """`request.remote` is the client's address from here on."""

    @web.middleware
    async def middleware(request: web.Request, handler: Handler) -> web.StreamResponse:
        forwarded_for = request.headers.getall(FORWARDED_FOR, [])
        peer = request.remote or ""
        client = proxies.client_of(peer, forwarded_for) if forwarded_for else peer
        return await handler(request if client == peer else request.clone(remote=client))

    return middleware
