"""Connection URLs: whether one can be opened, before mavsdk says SUCCESS to what will not work.

mavsdk binds a UDP port with SO_REUSEADDR: a second program on the same port silently takes the traffic away.
"""

from __future__ import annotations

import ipaddress
import socket
from collections.abc import Sequence
from typing import Final
from urllib.parse import SplitResult, urlsplit

from app.domain.errors import LinkError

_SCHEMES: Final = ("udpin", "udpout", "tcpin", "tcpout", "serial", "raw")
_WITH_HOST: Final = frozenset({"udpin", "udpout", "tcpin", "tcpout"})


def check_connections(urls: Sequence[str]) -> None:
    """Raises LinkError for the first URL that cannot be opened, naming it and saying what to do."""
    bound: dict[int, str] = {}
    for url in urls:
        parts = _parse(url)
        if parts.scheme not in {"udpin", "tcpin"}:
            continue
        port = parts.port or 0
        if port in bound:
            raise LinkError(f"{url}: port {port} is already used by {bound[port]}", connection=url)
        bound[port] = url
        _probe(url, parts.hostname or "0.0.0.0", port, udp=parts.scheme == "udpin")


def _parse(url: str) -> SplitResult:
    try:
        parts = urlsplit(url)
        port = parts.port if parts.scheme in _WITH_HOST else None
    except ValueError as error:
        raise _wrong(url, str(error)) from error
    if parts.scheme not in _SCHEMES:
        raise _wrong(url, f"the scheme is none of {', '.join(_SCHEMES)}")
    if parts.scheme in _WITH_HOST:
        if not port:
            raise _wrong(url, "it has no port")
        try:
            ipaddress.ip_address(parts.hostname or "")
        except ValueError as error:
            raise _wrong(url, "mavsdk takes addresses as numbers, not host names") from error
    return parts


def _wrong(url: str, why: str) -> LinkError:
    return LinkError(
        f"{url!r} is no connection: {why}",
        hint="for example udpin://0.0.0.0:14540 or serial:///dev/ttyUSB0:57600",
        connection=url,
    )


def _probe(url: str, host: str, port: int, *, udp: bool) -> None:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_DGRAM if udp else socket.SOCK_STREAM) as probe:
        if not udp:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # a closed server's port is free
        try:
            probe.bind((host, port))
        except OSError as error:
            raise LinkError(
                f"cannot listen on {url}: {error.strerror}",
                hint="another ground station or gateway may use this port: end it, or choose another port",
                connection=url,
            ) from error
