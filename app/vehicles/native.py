"""Native mavsdk, typed: one instance for each connection and the systems found on it. The only importer of mavsdk."""

from __future__ import annotations

import asyncio
import logging
import os
import threading
from collections.abc import Callable, Container, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, ParamSpec, TypeVar

import mavsdk  # type: ignore[import-untyped]
from mavsdk.logging import LogCallback  # type: ignore[import-untyped]
from mavsdk.plugins.mavlink_direct import MavlinkDirect, MavlinkDirectError, MavlinkMessage  # type: ignore[import-untyped]
from mavsdk.plugins.mission_raw import MissionItem as RawItem  # type: ignore[import-untyped]
from mavsdk.plugins.mission_raw import MissionRaw, MissionRawError
from mavsdk.plugins.param import Param, ParamError, ParamResult  # type: ignore[import-untyped]

from app.domain.errors import LinkError
from app.domain.mission import MissionType
from app.vehicles.encoders import Outgoing
from app.vehicles.mission_wire import WireItem
from app.vehicles.settings import OWN_SYSTEM_ID

_CACHE: Final = Path(".cache", "mavsdk", "component_metadata")


def provide_cache_directory(data_dir: Path) -> None:
    """Make it in the user's home; where that cannot be written, in `data_dir`, which is HOME for this process then.

    mavsdk makes it when it finds a vehicle. The threads of two connections that do so at once get in each other's way
    ("Failed to create cache directory: Success"), and a service's user often has no home.
    """
    try:
        (Path.home() / _CACHE).mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):
        (data_dir / _CACHE).mkdir(parents=True, exist_ok=True)
        os.environ["HOME"] = str(data_dir.resolve())


T = TypeVar("T")


def settle_from_thread(future: asyncio.Future[T], result: T) -> None:
    """Set the result on the future's own loop. A future that is done and a loop that has ended are left as they are."""

    def settle() -> None:
        if not future.done():
            future.set_result(result)

    try:
        future.get_loop().call_soon_threadsafe(settle)
    except RuntimeError:
        return  # the loop has ended


# A call that blocks, on a thread that cannot keep the process from ending.
#
# Not the default executor: its threads are joined at exit, and a mavsdk call cut off by destroy() never returns.


_log = logging.getLogger(__name__)


class BlockingCall:
    """Runs one blocking call at a time."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._turn = asyncio.Lock()
        self._under_way: asyncio.Future[None] | None = None
        self._closed = False

    async def run(self, call: Callable[[], T]) -> T:
        """The call's result or its LinkError. Cancelling the waiter does not stop the call."""
        async with self._turn:
            if self._closed:
                raise LinkError("the link is closed")
            ended: asyncio.Future[None] = asyncio.get_running_loop().create_future()
            outcome: list[T | LinkError] = []

            def body() -> None:
                try:
                    outcome.append(call())
                except LinkError as error:
                    outcome.append(error)
                settle_from_thread(ended, None)

            self._under_way = ended
            threading.Thread(target=body, name=self._name, daemon=True).start()
            await asyncio.shield(ended)
        if isinstance(outcome[0], LinkError):
            raise outcome[0]
        return outcome[0]

    async def close(self, *, timeout_s: float) -> None:
        """Start none any more, and wait for the one under way."""
        self._closed = True
        if self._under_way is None or self._under_way.done():
            return
        _, pending = await asyncio.wait({self._under_way}, timeout=timeout_s)
        if pending:
            _log.error("a blocking call did not end in %.1f s; its thread is abandoned", timeout_s)


# One vehicle as native mavsdk sees it, typed: messages, mission transfers, one blocking parameter read.
#
# All callbacks run on mavsdk's threads: what is given to them must only hand over, never block or destroy.


OUR_COMPONENT_ID: Final = 190
AUTOPILOT_COMPONENT_ID: Final = 1
_KEPT_CALLBACKS: Final = 8

RawSink = Callable[[str, str], None]
"""Gets a message's name and its fields as JSON, on mavsdk's thread."""


class NativeSystem:
    """One system id on one connection. Nothing here waits, but `read_int_parameter`."""

    def __init__(self, system: Any, own_system_id: int) -> None:
        self._system = system
        self.own_system_id = own_system_id
        self._direct: Any = MavlinkDirect(system)
        self._mission: Any = MissionRaw(system)
        self._param: Any = Param(system)
        self.system_id = int(system.get_system_id())

    def listen(self, names: Sequence[str], of_any: Container[str], sink: RawSink) -> None:
        """Give each message with one of these names from the autopilot to `sink`; those `of_any` component too."""

        def hand_over(message: Any, _data: object) -> None:
            if message.component_id == AUTOPILOT_COMPONENT_ID or message.message_name in of_any:
                sink(message.message_name, message.fields_json)

        for name in names:
            self._direct.subscribe_message(name, hand_over)

    def send(self, message: Outgoing) -> None:
        """Send to the autopilot. Raises LinkError if mavsdk has no connection for it."""
        native = MavlinkMessage(
            message_name=message.name,
            system_id=self.own_system_id,
            component_id=OUR_COMPONENT_ID,
            target_system_id=self.system_id,
            target_component_id=AUTOPILOT_COMPONENT_ID,
            fields_json=message.fields_json(self.system_id, AUTOPILOT_COMPONENT_ID),
        )
        try:
            self._direct.send_message(native)
        except MavlinkDirectError as error:
            raise LinkError(f"cannot send {message.name}: {error.result.name}", result=error.result.name) from error

    def upload(self, mission_type: MissionType, items: Sequence[WireItem], done: Callable[[str], None]) -> None:
        """Start an upload. `done` gets the result's name. A transfer that destroy() cuts off never calls it."""
        self._forget_callbacks()
        start = {
            MissionType.MISSION: self._mission.upload_mission_async,
            MissionType.FENCE: self._mission.upload_geofence_async,
            MissionType.RALLY: self._mission.upload_rally_points_async,
        }[mission_type]
        call = _called_once(done)
        start([RawItem(**item._asdict()) for item in items], lambda result, _data: call(result.name))

    def download(self, mission_type: MissionType, done: Callable[[str, list[WireItem]], None]) -> None:
        """Start a download. `done` gets the result's name and the items."""
        self._forget_callbacks()
        start = {
            MissionType.MISSION: self._mission.download_mission_async,
            MissionType.FENCE: self._mission.download_geofence_async,
            MissionType.RALLY: self._mission.download_rallypoints_async,
        }[mission_type]
        call = _called_once(done)
        start(lambda result, items, _data: call(result.name, [_wire(item) for item in items]))

    def cancel_transfers(self) -> None:
        """Cancel what is under way; the vehicle is told (MISSION_ACK 15) and `done` gets TRANSFER_CANCELLED."""
        for cancel in (self._mission.cancel_mission_upload, self._mission.cancel_mission_download):
            with suppress(MissionRawError):  # ERROR: there is none
                cancel()

    def read_int_parameter(self, name: str) -> int | None:
        """Read an int parameter; None if it did not come. BLOCKS up to 3 s: only for a worker thread."""
        try:
            return int(self._param.get_param_int(name))
        except ParamError as error:
            if error.result in {ParamResult.TIMEOUT, ParamResult.DOES_NOT_EXIST, ParamResult.WRONG_TYPE}:
                return None
            raise LinkError(f"cannot read {name}: {error.result.name}", result=error.result.name) from error

    def _forget_callbacks(self) -> None:
        # mavsdk keeps each callback until its plugin ends; the last ones may still be returning
        del self._mission._callbacks[:-_KEPT_CALLBACKS]


P = ParamSpec("P")


def _called_once(done: Callable[P, None]) -> Callable[P, None]:
    """Forgets `done` as it calls it: mavsdk keeps its callbacks, and must not keep the transfers that they end."""
    waiting = [done]

    def call(*args: P.args, **kwargs: P.kwargs) -> None:
        if waiting:
            waiting.pop()(*args, **kwargs)

    return call


def _wire(item: Any) -> WireItem:
    return WireItem(*(getattr(item, name) for name in WireItem._fields))


# One native mavsdk instance: a connection and the systems found on it. Only here and in mavsdk_system is mavsdk used.
#
# mavsdk's own comments have the shutdown rules: destroy() on the main thread, never inside a callback, never while a
# blocking call is under way.


MAX_INSTANCES: Final = 15
"""mavsdk has 16 channels a process; the 17th instance overwrites memory."""

_log = logging.getLogger("mavsdk")
_LEVELS: Final = (logging.DEBUG, logging.DEBUG, logging.INFO, logging.WARNING)
_live: set[NativeInstance] = set()
_lock = threading.Lock()
_log_callback: Any = None


class NativeInstance:
    """A mavsdk instance that acts as a ground station on one connection."""

    def __init__(self, connection_url: str, own_system_id: int = OWN_SYSTEM_ID) -> None:
        """Create the instance and open the connection.

        Raises:
            LinkError: too many instances in this process, or mavsdk refuses the connection.
        """
        self._systems: dict[int, NativeSystem] = {}
        self._own_system_id = own_system_id
        _enter(self)
        configuration = mavsdk.Configuration.create_with_component_type(mavsdk.ComponentType.GROUND_STATION)
        configuration.system_id = own_system_id
        self._mavsdk: Any = mavsdk.Mavsdk(configuration)
        configuration.destroy()
        result = self._mavsdk.add_any_connection(connection_url)
        if result != mavsdk.ConnectionResult.SUCCESS:
            self.destroy()
            raise LinkError(
                f"cannot open the connection {connection_url}: {result.name}",
                hint="use an address such as udpin://0.0.0.0:14540 or serial:///dev/ttyUSB0:57600, hosts as numbers",
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
            native = NativeSystem(system, self._own_system_id)
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
