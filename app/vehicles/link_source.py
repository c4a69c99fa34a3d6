"""LinkSource on native mavsdk: one instance per connection, the vehicles found on each, and their end."""

from __future__ import annotations

import asyncio
import ipaddress
import logging
import socket
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Final
from urllib.parse import SplitResult, urlsplit

from app.domain.errors import LinkError
from app.domain.ports.vehicle_link import Unsubscribe, VehicleLink
from app.domain.reasons import ReasonCode, because
from app.vehicles.link import MavsdkVehicleLink
from app.vehicles.native import MAX_INSTANCES, NativeInstance, NativeSystem
from app.vehicles.settings import LinkSettings

# Connection URLs: whether one can be opened, before mavsdk says SUCCESS to what will not work.
#
# mavsdk binds a UDP port with SO_REUSEADDR: a second program on the same port silently takes the traffic away.


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


_TICK_S: Final = 0.25
_LOOK_EVERY: Final = 4
_DEFAULTS: Final = LinkSettings()
_log = logging.getLogger(__name__)


class MavsdkLinkSource:
    """Finds vehicles on its connections. A vehicle is announced with its first HEARTBEAT after its discovery."""

    def __init__(self, connection_urls: Sequence[str], *, settings: LinkSettings = _DEFAULTS) -> None:
        self._urls = tuple(connection_urls)
        self._settings = settings
        self._instances: dict[str, NativeInstance] = {}
        self._links: list[MavsdkVehicleLink] = []
        self._announced: list[MavsdkVehicleLink] = []
        self._listeners: list[Callable[[VehicleLink], None]] = []
        self._ticker: asyncio.Task[None] | None = None

    def links(self) -> Sequence[VehicleLink]:
        """See LinkSource."""
        return tuple(self._announced)

    def subscribe(self, listener: Callable[[VehicleLink], None]) -> Unsubscribe:
        """See LinkSource."""
        self._listeners.append(listener)

        def unsubscribe() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)

        return unsubscribe

    async def start(self) -> None:
        """See LinkSource. Nothing stays open if one connection cannot be opened."""
        if len(self._urls) > MAX_INSTANCES:
            raise LinkError(
                f"{len(self._urls)} connections, at most {MAX_INSTANCES} in one process",
                hint="put several vehicles on one connection, or start another gateway process",
            )
        check_connections(self._urls)
        try:
            for url in self._urls:
                self._instances[url] = NativeInstance(url)
        except LinkError:
            self._destroy_instances()
            raise
        loop = asyncio.get_running_loop()
        for url, instance in self._instances.items():
            instance.on_new_system(partial(_on_thread, loop, partial(self._look, url)))
        self._ticker = asyncio.create_task(self._tick(), name="link ticker")

    async def close(self) -> None:
        """See LinkSource."""
        self._listeners.clear()
        if self._ticker is not None:
            self._ticker.cancel()
            await asyncio.gather(self._ticker, return_exceptions=True)
            self._ticker = None
        try:
            await asyncio.gather(*(link.close() for link in self._links))
        finally:
            self._destroy_instances()

    def _destroy_instances(self) -> None:
        for instance in self._instances.values():
            instance.destroy()
        self._instances.clear()

    async def _tick(self) -> None:
        turn = 0
        while True:
            now_s = time.monotonic()
            for link in self._links:
                link.tick(now_s)
            if turn % _LOOK_EVERY == 0:  # a system may show its autopilot after its first component
                for url in tuple(self._instances):
                    self._look(url)
            turn += 1
            await asyncio.sleep(_TICK_S)

    def _look(self, url: str) -> None:
        instance = self._instances.get(url)
        for system in () if instance is None else instance.new_systems():
            self._found(system, url)

    def _found(self, system: NativeSystem, url: str) -> None:
        link = MavsdkVehicleLink(system, url, self._settings, self._announce)
        first = next((known for known in self._links if known.identity.system_id == system.system_id), None)
        self._links.append(link)
        if first is not None:
            also = first.identity.connection
            link.quarantine(because(ReasonCode.TWO_CONNECTIONS, system_id=system.system_id, connection=url, also=also))

    def _announce(self, link: MavsdkVehicleLink) -> None:
        self._announced.append(link)
        for listener in tuple(self._listeners):
            listener(link)


def _on_thread(loop: asyncio.AbstractEventLoop, call: Callable[[], None]) -> None:
    try:
        loop.call_soon_threadsafe(call)
    except RuntimeError:
        return  # the loop has ended; nobody looks for vehicles any more
