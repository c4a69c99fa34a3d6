"""One native mavsdk instance: a connection and the systems found on it. Only here and in mavsdk_system is mavsdk used.

mavsdk's own comments tell the shutdown rules: destroy() on the main thread, never inside a callback, never while a
blocking call is under way.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Any, Final

import mavsdk  # type: ignore[import-untyped]
from mavsdk.logging import LogCallback  # type: ignore[import-untyped]

from app.domain.errors import LinkError
from app.vehicles.mavsdk_system import NativeSystem

MAX_INSTANCES: Final = 15
"""mavsdk has 16 channels a process; the 17th instance overwrites memory."""

_log = logging.getLogger("mavsdk")
_LEVELS: Final = (logging.DEBUG, logging.DEBUG, logging.INFO, logging.WARNING)
_live: set[NativeInstance] = set()
_lock = threading.Lock()
_log_callback: Any = None


class NativeInstance:
    """A mavsdk instance that acts as ground station 245/190 on one connection."""

    def __init__(self, connection_url: str) -> None:
        """Create the instance and open the connection.

        Raises:
            LinkError: too many instances in this process, or mavsdk refuses the connection.
        """
        self._systems: dict[int, NativeSystem] = {}
        _enter(self)
        configuration = mavsdk.Configuration.create_with_component_type(mavsdk.ComponentType.GROUND_STATION)
        self._mavsdk: Any = mavsdk.Mavsdk(configuration)
        configuration.destroy()
        result = self._mavsdk.add_any_connection(connection_url)
        if result != mavsdk.ConnectionResult.SUCCESS:
            self.destroy()
            raise LinkError(
                f"cannot open the connection {connection_url}: {result.name}",
                hint="an address is written as udpin://0.0.0.0:14540 or serial:///dev/ttyUSB0:57600, hosts as numbers",
                connection=connection_url,
                result=result.name,
            )

    def on_new_system(self, callback: Callable[[], None]) -> None:
        """Call `callback` on mavsdk's thread whenever a system appears. It must only hand over."""
        self._mavsdk.subscribe_on_new_system(lambda _data: callback())

    def new_systems(self) -> list[NativeSystem]:
        """The systems with an autopilot that no earlier call has returned."""
        fresh = []
        for system in self._mavsdk.get_systems():
            system_id = int(system.get_system_id())
            if system_id in self._systems or not system.has_autopilot():
                system.destroy()  # this wrapper only; each call hands out new ones
                continue
            native = NativeSystem(system)
            self._systems[system_id] = native
            fresh.append(native)
        return fresh

    def destroy(self) -> None:
        """End all callbacks and threads. On the main thread, outside any callback. Idempotent."""
        self._systems.clear()
        self._mavsdk.destroy()
        _leave(self)


def _enter(instance: NativeInstance) -> None:
    global _log_callback
    with _lock:
        if len(_live) >= MAX_INSTANCES:
            raise LinkError(
                f"at most {MAX_INSTANCES} connections in one process",
                hint="put several vehicles on one connection, or start another gateway process",
            )
        _live.add(instance)
        if _log_callback is None:
            # mavsdk's own wrapper prints a traceback when a STATUSTEXT is not UTF-8, so the C call is used
            _log_callback = LogCallback(_forward_log)
            mavsdk.logging._cmavsdk_lib.mavsdk_log_subscribe(_log_callback, None)


def _leave(instance: NativeInstance) -> None:
    global _log_callback
    with _lock:
        _live.discard(instance)
        if not _live and _log_callback is not None:
            mavsdk.log_unsubscribe()
            _log_callback = None


def _forward_log(level: int, message: bytes | None, _file: bytes | None, _line: int, _data: object) -> bool:
    if _log.isEnabledFor(_LEVELS[level]):
        _log.log(_LEVELS[level], "%s", (message or b"").decode("utf-8", "replace"))
    return True
