"""The PARAM protocol."""

from __future__ import annotations

from collections import deque

from app.simulator.dialect import Message, mavlink
from app.simulator.params import ParamError, Params
from app.simulator.radio import Radio, Sender
from app.simulator.wire import VEHICLE_COMPONENT

LIST_PER_POLL = 10
NO_INDEX = -1


class ParamLink:
    """Lists, reads and sets parameters."""

    def __init__(self, params: Params, radio: Radio) -> None:
        self._params = params
        self._radio = radio
        self._listing: deque[str] = deque()

    def on_request_list(self, _channel: Sender, message: Message) -> None:
        """PARAM_REQUEST_LIST; a second one begins again."""
        if self._for_me(message):
            self._listing = deque(self._params)

    def on_request_read(self, channel: Sender, message: Message) -> None:
        """PARAM_REQUEST_READ by name, or by index."""
        if not self._for_me(message):
            return
        name = message.param_id
        try:
            if message.param_index >= 0:
                name = self._params.name_at(message.param_index)
            self._send_value(name)
        except ParamError as error:
            self._send_error(channel, message, name, error)

    def on_set(self, channel: Sender, message: Message) -> None:
        """PARAM_SET, answered with the value to everybody."""
        if not self._for_me(message):
            return
        try:
            self._params.decode_and_set(message.param_id, message.param_value, message.param_type)
            self._send_value(message.param_id)
        except ParamError as error:
            self._send_error(channel, message, message.param_id, error)

    def poll(self) -> None:
        """Go on with a list, a few at a time."""
        if not self._listing:
            return
        for _ in range(min(LIST_PER_POLL, len(self._listing))):
            self._send_value(self._listing.popleft())

    def _for_me(self, message: Message) -> bool:
        mine = message.target_system in (0, self._radio.system_id)
        return mine and message.target_component in (0, VEHICLE_COMPONENT)

    def _send_value(self, name: str) -> None:
        value, kind = self._params.encode(name)
        index = self._params.index_of(name)
        message = mavlink.MAVLink_param_value_message(name.encode(), value, kind, len(self._params), index)
        self._radio.broadcast(message)

    def _send_error(self, channel: Sender, message: Message, name: str, error: ParamError) -> None:
        partner = (message.get_srcSystem(), message.get_srcComponent())
        self._radio.reply(channel, mavlink.MAVLink_param_error_message(*partner, name.encode(), NO_INDEX, error.code))
