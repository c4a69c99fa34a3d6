"""Commands about messages: REQUEST_MESSAGE, SET_MESSAGE_INTERVAL, GET_MESSAGE_INTERVAL."""

from __future__ import annotations

from app.simulator.commands.link import Handler, Request
from app.simulator.dialect import mavlink
from app.simulator.radio import Radio
from app.simulator.streams import Streams
from app.simulator.telemetry import Telemetry
from app.simulator.wire import Cmd, Result


class MessageCommands:
    """Handlers for the command link."""

    def __init__(self, telemetry: Telemetry, streams: Streams, radio: Radio) -> None:
        self._telemetry = telemetry
        self._streams = streams
        self._radio = radio

    def handlers(self) -> dict[int, Handler]:
        """Command number to handler."""
        return {
            Cmd.REQUEST_MESSAGE: self._request_message,
            Cmd.SET_MESSAGE_INTERVAL: self._set_interval,
            Cmd.GET_MESSAGE_INTERVAL: self._get_interval,
        }

    def _request_message(self, request: Request) -> Result:
        """The message comes before the ack."""
        message = self._telemetry.by_id(request.whole(1))
        if message is None:
            return Result.DENIED
        self._radio.reply(request.channel, message)
        return Result.ACCEPTED

    def _set_interval(self, request: Request) -> Result:
        known = self._streams.set_interval(request.whole(1), request.param2)
        return Result.ACCEPTED if known else Result.FAILED

    def _get_interval(self, request: Request) -> Result:
        message_id = request.whole(1)
        interval_us = self._streams.interval_us(message_id)
        self._radio.reply(request.channel, mavlink.MAVLink_message_interval_message(message_id, interval_us))
        return Result.ACCEPTED
