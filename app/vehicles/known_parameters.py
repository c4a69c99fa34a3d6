"""The parameters that Waydrop uses of one vehicle, as it told them last: asked for, or announced by itself.

PX4 tells every link what it changes, but not what it has not looked up itself yet: such answers have param_index 65535.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping
from typing import Final

from app.vehicles.decoders import ParamValue
from app.vehicles.inbox import Inbox
from app.vehicles.parameters import Value, value_of

HASH_CHECK: Final = "_HASH_CHECK"
"""The checksum of all, asked for like a parameter and none."""
_NOT_LOOKED_UP: Final = 65535


class KnownParameters:
    """`values` is replaced by a new mapping at each change, so that facts that were given away stay as they were.

    `changed` is called with what is different now, on the loop. `unclear` is called with the name of a negative int,
    whose bits the link cannot carry: it has to be read. `unanswered` are names that were asked for without an answer:
    they are known as soon as the vehicle tells them.
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
        self._told: dict[str, tuple[Value, float]] = {}
        """What a message said last, and when: an answer that was read may be older than an announcement."""
        self._changed = changed
        self._unclear = unclear
        inbox.on(ParamValue, self._take)

    @property
    def unannounced(self) -> frozenset[str]:
        """Those whose changes the vehicle does not tell by itself."""
        return frozenset(self._silent & self.values.keys())

    def age_s(self) -> float:
        """Seconds since `confirmed_s`; infinite if None."""
        return float("inf") if self.confirmed_s is None else time.monotonic() - self.confirmed_s

    def forget(self) -> None:
        """The vehicle restarted: nothing is known."""
        self.values, self.confirmed_s = {}, None
        self._silent.clear()
        self._told.clear()

    def put_read(self, found: Mapping[str, Value], since_s: float) -> None:
        """Take in what was read from `since_s` (monotonic) on, unless the vehicle has told another value meanwhile."""
        told = {name: value for name, (value, at_s) in self._told.items() if name in found and at_s >= since_s}
        self._put({**found, **told})

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
            self._told[name] = (value, time.monotonic())
        is_used = name in self.values or (name in self._unanswered and name != HASH_CHECK)
        if not (self.values and is_used):
            return
        if value is None:
            self._unclear(name)
        else:
            self._put({name: value})
