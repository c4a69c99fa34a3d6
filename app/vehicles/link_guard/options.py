"""Connection URLs: mavsdk's, with the guard's options behind a question mark.

`udpin://0.0.0.0:14540?peer=10.8.0.0/24&system=1&system=2`
"""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass, field
from typing import Final
from urllib.parse import parse_qsl, urlsplit

from app.domain.errors import LinkError

SCHEMES: Final = ("udpin", "udpout", "tcpin", "tcpout", "serial")
MOST_SYSTEMS: Final = 32
"""System ids that one connection takes, if it does not name them: mavsdk spends a thread on each, for ever."""

_Network = ipaddress.IPv4Network | ipaddress.IPv6Network


@dataclass(frozen=True, slots=True)
class ConnectionOptions:
    """`peers`: networks from which vehicles may speak; none: the first that shows a vehicle's HEARTBEAT is pinned.

    `any_peer`: everybody may. `systems`: the ids that are taken; none: any, up to `most_systems`. `signing`: keys count
    here. `link_id` is that of our signatures: two gateways that share a key need two.
    """

    peers: tuple[_Network, ...] = ()
    any_peer: bool = False
    systems: frozenset[int] = frozenset()
    most_systems: int = MOST_SYSTEMS
    signing: bool = True
    link_id: int | None = None

    def allows(self, address: str) -> bool:
        """Whether a vehicle may speak from this address."""
        if not self.peers:
            return True
        place = ipaddress.ip_address(address.partition("%")[0])
        if isinstance(place, ipaddress.IPv6Address) and place.ipv4_mapped is not None:
            place = place.ipv4_mapped
        return any(place in network for network in self.peers)


@dataclass(frozen=True, slots=True)
class Connection:
    """A connection as configured. `name` is its URL without options; a serial `host` is the device, `port` the baud."""

    scheme: str
    host: str
    port: int
    options: ConnectionOptions = field(default_factory=ConnectionOptions)

    @property
    def name(self) -> str:
        """What it is called in events, views and logs."""
        host = f"[{self.host}]" if ":" in self.host and self.scheme != "serial" else self.host
        return f"{self.scheme}://{host}:{self.port}"


def parse_connection(url: str) -> Connection:
    """The connection of a URL. Raises LinkError naming it and what is wrong."""
    base, _, query = url.partition("?")
    scheme = base.partition("://")[0]
    if scheme not in SCHEMES:
        raise _wrong(url, f"the scheme is none of {', '.join(SCHEMES)}")
    options = _options(url, query)
    host, port = _device(url, base) if scheme == "serial" else _address(url, base)
    if scheme == "serial" and (options.peers or options.any_peer):
        raise _wrong(url, "a serial device has no peers to choose from")
    return Connection(scheme, host, port, options)


def _address(url: str, base: str) -> tuple[str, int]:
    try:
        parts = urlsplit(base)
        host, port = parts.hostname or "", parts.port
    except ValueError as error:
        raise _wrong(url, str(error)) from error
    if not port:
        raise _wrong(url, "it has no port")
    try:
        ipaddress.ip_address(host)
    except ValueError as error:
        raise _wrong(url, "addresses are written as numbers, not as host names") from error
    return host, port


def _device(url: str, base: str) -> tuple[str, int]:
    device, colon, baud = base.removeprefix("serial://").rpartition(":")
    if not colon or not device.startswith("/") or not baud.isascii() or not baud.isdigit():
        raise _wrong(url, "a serial device is written with its path and its baud rate")
    return device, int(baud)


def _options(url: str, query: str) -> ConnectionOptions:
    peers: list[_Network] = []
    systems: set[int] = set()
    found: dict[str, object] = {}
    for name, value in parse_qsl(query, keep_blank_values=True):
        match name:
            case "peer" if value == "any":
                found["any_peer"] = True
            case "peer":
                peers.append(_network(url, value))
            case "system":
                systems.add(_number(url, name, value, 1, 255))
            case "most_systems":
                found["most_systems"] = _number(url, name, value, 1, 255)
            case "link_id":
                found["link_id"] = _number(url, name, value, 0, 255)
            case "signing" if value in ("on", "off"):
                found["signing"] = value == "on"
            case _:
                raise _wrong(url, f"{name}={value} is no option: peer, system, most_systems, signing, link_id are")
    if peers and "any_peer" in found:
        raise _wrong(url, "peer=any beside another peer: either everybody may speak there, or those")
    return ConnectionOptions(peers=tuple(peers), systems=frozenset(systems), **found)  # type: ignore[arg-type]


def _network(url: str, text: str) -> _Network:
    try:
        return ipaddress.ip_network(text, strict=False)
    except ValueError as error:
        raise _wrong(url, f"peer={text} is neither an address nor a network, nor `any`") from error


def _number(url: str, name: str, text: str, low: int, high: int) -> int:
    if not (text.isascii() and text.isdigit() and low <= int(text) <= high):
        raise _wrong(url, f"{name}={text} is no number from {low} to {high}")
    return int(text)


def _wrong(url: str, why: str) -> LinkError:
    return LinkError(
        f"{url!r} is no connection: {why}",
        hint="for example udpin://0.0.0.0:14540?peer=10.8.0.0/24 or serial:///dev/ttyUSB0:57600",
        connection=url,
    )
