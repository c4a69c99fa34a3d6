"""The PARAM protocol: answers go to the link that asks, changes to all links [28_param_changed]."""

from __future__ import annotations

import struct
from collections import deque

from app.simulator.channel import Radio, Sender
from app.simulator.clock import VehicleClock
from app.simulator.dialect import Message, mavlink
from app.simulator.params import MAV_PARAM_TYPE_UINT32, ParamError, Params
from app.simulator.wire import VEHICLE_COMPONENT

LIST_PER_POLL = 10
NO_INDEX = -1
HASH_CHECK = "_HASH_CHECK"
ANNOUNCED_AFTER_S = 0.015
"""The 5 ms in which PX4 gathers changes, and a cycle of its link's loop."""
SAID_AFTER_BOOT_S = 0.97
SAVED_AFTER_S, BETWEEN_SAVES_S = 0.3, 2.0
"""PX4's autosave: what is saved is not announced any more."""


class ParamLink:
    """Lists, reads and sets parameters, and announces those that changed."""

    def __init__(self, params: Params, radio: Radio, clock: VehicleClock, says_errors: bool) -> None:
        self._params = params
        self._says_errors = says_errors
        self._radio = radio
        self._clock = clock
        self._listing: list[tuple[Sender, deque[str]]] = []
        self._version = params.version
        self._announce_s: float | None = None
        self._save_s: float | None = None
        self._saved_s = -BETWEEN_SAVES_S
        self._just_set: set[str] = set()

    def boot(self) -> None:
        """Power-up: what is not saved yet is announced once."""
        self._params.boot()
        self._listing.clear()
        self._version = self._params.version
        self._announce_s = SAID_AFTER_BOOT_S if self._params.unsaved else None
        self._save_s = SAID_AFTER_BOOT_S + SAVED_AFTER_S if self._params.unsaved else None
        self._saved_s = -BETWEEN_SAVES_S

    def on_request_list(self, channel: Sender, message: Message) -> None:
        """PARAM_REQUEST_LIST: the hash and all that are used; a second one begins again, without the hash."""
        if self._for_me(message):
            again = self._end_list(channel)
            self._listing.append((channel, deque(self._params if again else (HASH_CHECK, *self._params))))

    def on_request_read(self, channel: Sender, message: Message) -> None:
        """PARAM_REQUEST_READ by name, or by index."""
        if not self._for_me(message):
            return
        name = message.param_id
        try:
            if message.param_index >= 0:
                name = self._params.name_at(message.param_index)
            self._radio.reply(channel, self._value(name))
        except ParamError as error:
            self._send_error(channel, message, name, error)

    def on_set(self, channel: Sender, message: Message) -> None:
        """PARAM_SET, answered with the value. One of the hash, which nobody can set, ends a list."""
        if not self._for_me(message):
            return
        try:
            if message.param_id == HASH_CHECK:
                self._end_list(channel)
                raise ParamError(ParamError.READ_ONLY)
            self._params.decode_and_set(message.param_id, message.param_value, message.param_type)
            self._just_set.add(message.param_id)
            self._radio.reply(channel, self._value(message.param_id))
        except ParamError as error:
            self._send_error(channel, message, message.param_id, error)

    def poll(self) -> None:
        """Announce and save what was changed; go on with lists, a few at a time."""
        self._announce()
        for channel, names in tuple(self._listing):
            for _ in range(min(LIST_PER_POLL, len(names))):
                self._radio.reply(channel, self._value(names.popleft()))
            if not names:
                self._end_list(channel)

    def _end_list(self, channel: Sender) -> bool:
        """Whether one was under way on this link."""
        going_on = [one for one in self._listing if one[0] is not channel]
        ended = len(going_on) < len(self._listing)
        self._listing = going_on
        return ended

    def _announce(self) -> None:
        now_s = self._clock.now_s
        self._save(now_s)
        if self._version != self._params.version:
            self._version = self._params.version
            if self._announce_s is None:
                self._announce_s = now_s + ANNOUNCED_AFTER_S
            if self._save_s is None:
                self._save_s = max(now_s + SAVED_AFTER_S, self._saved_s + BETWEEN_SAVES_S)
        if self._announce_s is not None and now_s >= self._announce_s:
            self._announce_s = None
            for name in self._params.to_announce():
                self._radio.broadcast(self._value(name))

    def _save(self, now_s: float) -> None:
        """Before what was set in this cycle is announced: that is not saved with it."""
        if self._save_s is not None and now_s >= self._save_s:
            self._save_s, self._saved_s = None, now_s
            self._params.unsaved &= self._just_set
        self._just_set.clear()

    def _for_me(self, message: Message) -> bool:
        mine = message.target_system in (0, self._radio.system_id)
        return mine and message.target_component in (0, VEHICLE_COMPONENT)

    def _value(self, name: str) -> Message:
        """PARAM_VALUE. Raises ParamError."""
        if name == HASH_CHECK:
            value, kind = struct.unpack("<f", struct.pack("<I", self._params.checksum()))[0], MAV_PARAM_TYPE_UINT32
            index = Params.NO_INDEX
        else:
            value, kind = self._params.encode(name)
            index = self._params.index_of(name)
        return mavlink.MAVLink_param_value_message(name.encode(), value, kind, len(self._params), index)

    def _send_error(self, channel: Sender, message: Message, name: str, error: ParamError) -> None:
        if not self._says_errors:
            return
        partner = (message.get_srcSystem(), message.get_srcComponent())
        self._radio.reply(channel, mavlink.MAVLink_param_error_message(*partner, name.encode(), NO_INDEX, error.code))
