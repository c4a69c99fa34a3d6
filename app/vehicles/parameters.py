"""PX4 parameters by name, many at once, each with its own time-out.

mavsdk's param plugin blocks a thread for up to 3 s a name, one after another, and destroy() during that hangs for ever.
So PARAM_REQUEST_READ goes through mavlink_direct. PX4 packs an int's bits into the float field, and JSON has no NaN
with a payload: the bits of a negative int are lost there. Only then the plugin reads the value, from a vehicle that
has just answered for that very name.
"""

from __future__ import annotations

import asyncio
import struct
import time
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Final

from app.domain.errors import LinkError
from app.vehicles.decoders import ParamError, ParamValue
from app.vehicles.encoders import Outgoing, ParamRequestRead
from app.vehicles.inbox import Inbox
from app.vehicles.native import OUR_COMPONENT_ID, BlockingCall
from app.vehicles.settings import LinkSettings

_UINT32: Final = 5
_REAL32: Final = 9
_AT_ONCE: Final = 16
Value = int | float


def value_of(message: ParamValue) -> Value | None:
    """The value; None if it is a negative int, which has to be read by other means."""
    if message.value is None or message.param_type == _REAL32:
        return message.value
    return int(struct.unpack("<i", struct.pack("<f", message.value))[0])


class ParameterReader:
    """Reads parameters of one vehicle. `read_int` is the blocking call for negative ints."""

    def __init__(
        self,
        send: Callable[[Outgoing], None],
        read_int: Callable[[str], int | None],
        inbox: Inbox,
        settings: LinkSettings,
    ) -> None:
        self._send = send
        self._read_int = read_int
        self._settings = settings
        self._inbox = inbox
        self._waiting: defaultdict[str, list[asyncio.Future[ParamValue | None]]] = defaultdict(list)
        self._plugin = BlockingCall("waydrop-param")
        self.unanswered: set[str] = set()
        """Those that gave neither a value nor a PARAM_ERROR when they were asked for last."""
        inbox.on(ParamValue, self._take_value)
        inbox.on(ParamError, self._take_error)

    async def read(self, names: Iterable[str]) -> dict[str, Value]:
        """The values of those that exist. One that does not answer within all its attempts is left out.

        Several may read at once, also the same names: an answer is for all who wait for that name.

        Raises:
            LinkError: the link was closed meanwhile.
        """
        wanted = tuple(dict.fromkeys(names))
        self._inbox.parameters.update(wanted)
        values: dict[str, Value] = {}
        left = iter(wanted)

        async def one_after_another() -> None:
            for name in left:
                if (value := await self._one(name)) is not None:
                    values[name] = value

        # not a task for each name: of many vehicles at once these would take more memory than all that is kept of them
        tasks = [asyncio.ensure_future(one_after_another()) for _ in wanted[:_AT_ONCE]]
        try:
            await asyncio.gather(*tasks)
        finally:
            for task in tasks:
                task.cancel()
        return {name: values[name] for name in wanted if name in values}

    def is_reading(self, name: str) -> bool:
        """Whether somebody waits for it."""
        return name in self._waiting

    async def close(self, *, timeout_s: float) -> None:
        """End all waits with LinkError, and wait for the blocking call if one is under way."""
        for future in [one for waiting in self._waiting.values() for one in waiting]:
            if not future.done():
                future.set_exception(LinkError("the link was closed"))
        await self._plugin.close(timeout_s=timeout_s)

    async def _one(self, name: str) -> Value | None:
        future: asyncio.Future[ParamValue | None] = asyncio.get_running_loop().create_future()
        self._waiting[name].append(future)  # one for each reader: who is cancelled takes nothing from the others
        try:
            for _ in range(self._settings.parameter_attempts):
                self._send(ParamRequestRead(name))
                done, _pending = await asyncio.wait({future}, timeout=self._settings.parameter_timeout_s)
                if done:
                    self.unanswered.discard(name)
                    return await self._value(future.result())
            self.unanswered.add(name)
            return None
        finally:
            self._waiting[name].remove(future)
            if not self._waiting[name]:
                del self._waiting[name]

    async def _value(self, message: ParamValue | None) -> Value | None:
        if message is None:
            return None
        value = value_of(message)
        if value is None and message.param_type not in (_REAL32, _UINT32):
            return await self._plugin.run(lambda: self._read_int(message.param_id))
        return value

    def _take_value(self, message: ParamValue, _received_s: float) -> None:
        self._answer(message.param_id, message)

    def _take_error(self, message: ParamError, _received_s: float) -> None:
        if (message.target_system, message.target_component) == (self._settings.own_system_id, OUR_COMPONENT_ID):
            self._answer(message.param_id, None)

    def _answer(self, name: str, message: ParamValue | None) -> None:
        for future in self._waiting.get(name, ()):
            if not future.done():
                future.set_result(message)


# The parameters that Waydrop uses of one vehicle, as it reported them last: requested, or announced by itself.
#
# PX4 announces its changes to every link, except of parameters that it has not looked up itself yet: such answers have
# param_index 65535.


HASH_CHECK: Final = "_HASH_CHECK"
"""The checksum of all, asked for like a parameter and none."""
_NOT_LOOKED_UP: Final = 65535


class KnownParameters:
    """`values` is replaced by a new mapping at each change, so that facts that were given away stay as they were.

    `changed` is called with what is different now, on the loop. `unclear` is called with the name of a negative int,
    whose bits the link cannot carry: it has to be read. `unanswered` are names that were asked for without an answer:
    they are known as soon as the vehicle reports them.
    """

    def __init__(
        self,
        inbox: Inbox,
        changed: Callable[[Mapping[str, Value]], None],
        unclear: Callable[[str], None],
        unanswered: Collection[str] = (),
    ) -> None:
        self.values: Mapping[str, Value] = {}
        self.confirmed_s: float | None = None
        """When all of them were last known to be the vehicle's; None: not yet, or not since the link was lost."""
        self._silent: set[str] = set()
        self._unanswered = unanswered
        self._announced: dict[str, tuple[Value, float]] = {}
        """What a message said last, and when: an answer that was read may be older than an announcement."""
        self._changed = changed
        self._unclear = unclear
        inbox.on(ParamValue, self._take)

    @property
    def unannounced(self) -> frozenset[str]:
        """Those whose changes the vehicle does not announce."""
        return frozenset(self._silent & self.values.keys())

    def age_s(self) -> float:
        """Seconds since `confirmed_s`; infinite if None."""
        return float("inf") if self.confirmed_s is None else time.monotonic() - self.confirmed_s

    def confirm(self, at_s: float) -> None:
        """All of them were the vehicle's at this time (monotonic)."""
        self.confirmed_s = at_s

    def doubt(self) -> None:
        """Changes may have been missed."""
        self.confirmed_s = None

    def forget(self) -> None:
        """The vehicle restarted: nothing is known."""
        self.values, self.confirmed_s = {}, None
        self._silent.clear()
        self._announced.clear()

    def put_read(self, found: Mapping[str, Value], since_s: float) -> None:
        """Take in what was read from `since_s` (monotonic) on, unless the vehicle has announced another value since."""
        newer = {name: value for name, (value, at_s) in self._announced.items() if name in found and at_s >= since_s}
        self._put({**found, **newer})

    def _put(self, found: Mapping[str, Value]) -> None:
        news = {name: value for name, value in found.items() if self.values.get(name) != value}
        changes = {name: value for name, value in news.items() if name in self.values}
        if news:
            self.values = {**self.values, **news}
        if changes:
            self._changed(changes)

    def _take(self, message: ParamValue, _received_s: float) -> None:
        name = message.param_id
        (self._silent.add if message.param_index == _NOT_LOOKED_UP else self._silent.discard)(name)
        value = value_of(message)
        if value is not None:
            self._announced[name] = (value, time.monotonic())
        is_used = name in self.values or (name in self._unanswered and name != HASH_CHECK)
        if not (self.values and is_used):
            return
        if value is None:
            self._unclear(name)
        else:
            self._put({name: value})
