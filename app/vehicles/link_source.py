"""LinkSource on native mavsdk: one instance per connection, the vehicles found on each, and their end."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

from app.domain.errors import LinkError, NotFoundError
from app.domain.ports.vehicle_link import Unsubscribe, VehicleLink
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.link_security import Refused, Relayed
from app.vehicles.doorbell import Doorbell
from app.vehicles.link import MavsdkVehicleLink, SharedByLinks
from app.vehicles.link_guard.guard import LinkGuard
from app.vehicles.link_guard.memory import SigningStore
from app.vehicles.link_guard.options import Connection, parse_connection
from app.vehicles.native import MAX_INSTANCES, NativeInstance, NativeSystem
from app.vehicles.settings import LinkSettings
from app.vehicles.stream_rates import SET_UP_AT_ONCE


def check_connections(urls: Sequence[str]) -> Sequence[Connection]:
    """The connections. Raises LinkError for the first that cannot be opened, naming it and saying what to do."""
    bound: dict[tuple[str, int], str] = {}
    found = []
    for url in urls:
        connection = parse_connection(url)
        found.append(connection)
        if connection.scheme not in ("udpin", "tcpin"):
            continue
        place = (connection.scheme, connection.port)
        if place in bound:
            raise LinkError(f"{url}: port {connection.port} is already used by {bound[place]}", connection=url)
        bound[place] = url
    return found


_TICK_S: Final = 0.25
_LOOK_EVERY: Final = 4
_DEFAULTS: Final = LinkSettings()
_log = logging.getLogger(__name__)


class MavsdkLinkSource:
    """LinkSource and LinkGuards. A vehicle is announced with its first HEARTBEAT after its discovery."""

    def __init__(
        self,
        connection_urls: Sequence[str],
        *,
        settings: LinkSettings = _DEFAULTS,
        signing: SigningStore | None = None,
    ) -> None:
        """`signing`: the keys of the vehicles; without it nothing is signed."""
        self._urls = tuple(connection_urls)
        self._settings = settings
        self._signing = signing or SigningStore()
        self._guards: list[LinkGuard] = []
        self._instances: dict[LinkGuard, NativeInstance] = {}
        self._links: list[MavsdkVehicleLink] = []
        self._announced: list[MavsdkVehicleLink] = []
        self._listeners: list[Callable[[VehicleLink], None]] = []
        self._tasks: list[asyncio.Task[None]] = []
        self._setup_turns = asyncio.Semaphore(SET_UP_AT_ONCE)
        self._doorbell: Doorbell | None = None

    def links(self) -> Sequence[VehicleLink]:
        return tuple(self._announced)

    def subscribe(self, listener: Callable[[VehicleLink], None]) -> Unsubscribe:
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
        connections = check_connections(self._urls)
        self._doorbell = Doorbell()
        try:
            for index, connection in enumerate(connections):
                await self._open(connection, index)
        except LinkError:
            self._close_connections()
            raise
        loop = asyncio.get_running_loop()
        for guard, instance in self._instances.items():
            instance.on_new_system(partial(_on_thread, loop, partial(self._look, guard)))
        self._tasks = [
            asyncio.create_task(self._tick(), name="link ticker"),
            asyncio.create_task(self._keep_keys(), name="link keys"),
        ]

    def refused(self) -> Sequence[Refused]:
        return [refused for guard in self._guards for refused in guard.refused()]

    def relayed(self) -> Sequence[Relayed]:
        return [guard.relayed() for guard in self._guards]

    async def set_up_signing(self, system_id: int, connection: str) -> str:
        for guard in self._guards:
            if guard.connection.name == connection:
                return await guard.set_up_signing(system_id)
        raise NotFoundError(f"no connection {connection}")

    async def close(self) -> None:
        self._listeners.clear()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        self._tasks.clear()
        try:
            await asyncio.gather(*(link.close() for link in self._links))
        finally:
            self._close_connections()
            self._signing.close()

    async def _open(self, connection: Connection, index: int) -> None:
        guard = LinkGuard(connection, self._signing, index, self._settings.own_system_id)
        self._guards.append(guard)
        await guard.open()
        self._instances[guard] = NativeInstance(guard.inner_url, self._settings.own_system_id)
        guard.begin()

    def _close_connections(self) -> None:
        for guard in self._guards:
            guard.close()
        for instance in self._instances.values():
            instance.destroy()
        self._instances.clear()
        self._guards.clear()
        if self._doorbell is not None:  # after mavsdk's threads, which ring it
            self._doorbell.close()

    async def _tick(self) -> None:
        turn = 0
        while True:
            now_s = time.monotonic()
            for guard in self._guards:
                guard.tick(now_s)
            for link in self._links:
                link.tick(now_s)
            self._part_twins()
            if turn % _LOOK_EVERY == 0:  # a system may show its autopilot after its first component
                for guard in self._guards:
                    self._look(guard)
            turn += 1
            await asyncio.sleep(_TICK_S)

    async def _keep_keys(self) -> None:
        """Beside the ticker: links do not wait for a disk."""
        while True:
            if await self._signing.tick(time.monotonic()):
                for guard in self._guards:
                    guard.keys_changed()
            await asyncio.sleep(_TICK_S)

    def _look(self, guard: LinkGuard) -> None:
        instance = self._instances.get(guard)
        for system in () if instance is None else instance.new_systems():
            self._found(system, guard)

    def _found(self, system: NativeSystem, guard: LinkGuard) -> None:
        url = guard.connection.name
        security = partial(guard.security, system.system_id)
        station_age_s = partial(guard.ground_station_age_s, system.system_id)
        watch_items = partial(guard.watch_items, system.system_id)
        assert self._doorbell is not None, "it is there before the first connection"
        shared = SharedByLinks(self._setup_turns, self._doorbell.ring)
        link = MavsdkVehicleLink(
            system, url, self._settings, self._announce, security, station_age_s, watch_items, shared
        )
        first = next((known for known in self._links if known.identity.system_id == system.system_id), None)
        self._links.append(link)
        if first is not None:
            _quarantine_twin(link, first)

    def _part_twins(self) -> None:
        """Of links with one system id that are heard now, one is commanded: that which is heard for longest."""
        heard: dict[int, MavsdkVehicleLink] = {}
        for link in sorted(self._links, key=lambda one: (one.is_quarantined, one.heard_since_s)):
            first = heard.setdefault(link.identity.system_id, link) if link.is_connected else link
            if first is not link:
                _quarantine_twin(link, first)

    def _announce(self, link: MavsdkVehicleLink) -> None:
        self._announced.append(link)
        for listener in tuple(self._listeners):
            listener(link)


def _quarantine_twin(link: MavsdkVehicleLink, first: MavsdkVehicleLink) -> None:
    one, also = link.identity, first.identity.connection
    code = ReasonCode.TWO_CONNECTIONS
    link.quarantine(Reason.of(code, system_id=one.system_id, connection=one.connection, also=also))


def _on_thread(loop: asyncio.AbstractEventLoop, call: Callable[[], None]) -> None:
    try:
        loop.call_soon_threadsafe(call)
    except RuntimeError:
        return  # the loop has ended; nobody looks for vehicles any more
