"""COMMAND_LONG and COMMAND_INT in, COMMAND_ACK out. Commands are executed in the vehicle's next cycle."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from app.simulator.channel import Radio, Sender
from app.simulator.dialect import Message, mavlink
from app.simulator.faults import VehicleFaults
from app.simulator.payload import PayloadDeliverer
from app.simulator.streams import Streams
from app.simulator.telemetry import Telemetry
from app.simulator.wire import VEHICLE_COMPONENT, Cmd, Result

QUEUE_LIMIT = 64
INT32_MAX = 2147483647
NO_PROGRESS = 0
PROGRESS_UNKNOWN = 255


@dataclass(frozen=True, slots=True)
class Request:
    """A command from outside. `latitude_deg`, `longitude_deg`, `z` are params 5 to 7; NaN is "not given"."""

    command: int
    param1: float
    param2: float
    param3: float
    param4: float
    latitude_deg: float
    longitude_deg: float
    z: float
    channel: Sender
    source: tuple[int, int]

    def whole(self, number: int) -> int:
        """Param 1 to 3 as a whole number; 0 where it is none (NaN, infinite), as a cast on board mostly gives."""
        given = (self.param1, self.param2, self.param3)[number - 1]
        return int(given) if math.isfinite(given) else 0


Handler = Callable[[Request], Result | None]
"""Executes a command; None: it is acknowledged later, through `CommandLink.ack`, or by somebody else."""


class CommandLink:
    """Receives for component 1; what has another address gets no answer."""

    def __init__(self, radio: Radio, faults: VehicleFaults, handlers: Mapping[int, Handler]) -> None:
        self._radio = radio
        self._faults = faults
        self._handlers = handlers
        self._queue: deque[Request] = deque(maxlen=QUEUE_LIMIT)

    def on_command(self, channel: Sender, message: Message) -> None:
        """COMMAND_LONG or COMMAND_INT."""
        if message.target_system not in (0, self._radio.system_id):
            return
        if message.target_component not in (0, VEHICLE_COMPONENT):
            return
        self._queue.append(_request(channel, message))

    def step(self) -> None:
        """Execute what has come in since the last cycle."""
        while self._queue:
            request = self._queue.popleft()
            handler = self._handlers.get(request.command)
            result = handler(request) if handler is not None else Result.UNSUPPORTED
            if result is not None:
                self.ack(request, result)

    def reset(self) -> None:
        """A reboot forgets what was waiting."""
        self._queue.clear()

    def ack(self, request: Request, result: Result) -> None:
        """COMMAND_ACK to the one who asked, on the link he asked on."""
        if result is not Result.IN_PROGRESS and self._faults.take_lost_ack():
            return
        progress = PROGRESS_UNKNOWN if result is Result.IN_PROGRESS else NO_PROGRESS
        message = mavlink.MAVLink_command_ack_message(request.command, result, progress, 0, *request.source)
        self._radio.reply(request.channel, message)


def _request(channel: Sender, message: Message) -> Request:
    if message.get_type() == "COMMAND_INT":
        latitude = math.nan if message.x == INT32_MAX else message.x / 1e7
        longitude = math.nan if message.y == INT32_MAX else message.y / 1e7
        z = message.z
    else:
        latitude, longitude, z = message.param5, message.param6, message.param7
    return Request(
        command=message.command,
        param1=message.param1,
        param2=message.param2,
        param3=message.param3,
        param4=message.param4,
        latitude_deg=latitude,
        longitude_deg=longitude,
        z=z,
        channel=channel,
        source=(message.get_srcSystem(), message.get_srcComponent()),
    )


class MessageCommands:
    """REQUEST_MESSAGE, SET_MESSAGE_INTERVAL and GET_MESSAGE_INTERVAL: handlers for the command link."""

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


class PayloadCommands:
    """DO_GRIPPER and DO_WINCH: handlers for the command link; the acks come from the deliverer, in its own time.

    PX4's commander leaves both commands to other parts of the system: where none executes them nobody answers.
    """

    def __init__(self, payload: PayloadDeliverer | None) -> None:
        self._payload = payload
        self._link: CommandLink | None = None

    def connect(self, link: CommandLink) -> None:
        """Give the way back for acks."""
        self._link = link

    def handlers(self) -> dict[int, Handler]:
        """Command number to handler."""
        return {Cmd.DO_GRIPPER: self._gripper, Cmd.DO_WINCH: lambda request: None}

    def _gripper(self, request: Request) -> None:
        link = self._link
        if self._payload is None:
            return
        assert link is not None
        self._payload.command(request.param2, lambda result: link.ack(request, result))
