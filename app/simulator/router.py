"""Gives each received message to the component that speaks its protocol."""

from __future__ import annotations

from collections.abc import Callable

from app.simulator.channel import Radio, Sender
from app.simulator.clock import VehicleClock
from app.simulator.commands.link import CommandLink
from app.simulator.dialect import Message, mavlink
from app.simulator.failsafes import LinkLossFailsafe
from app.simulator.mission.transfer import MissionTransfer
from app.simulator.navigator.mission_mode import MissionMode
from app.simulator.offboard.receiver import OffboardReceiver
from app.simulator.param_link import ParamLink
from app.simulator.wire import VEHICLE_COMPONENT, Severity

MAV_TYPE_GCS = 6
MISSION_COMPONENTS = (0, VEHICLE_COMPONENT, 190)

Handle = Callable[[Sender, Message], None]


class Router:
    """Mission messages for another system or component are dropped here; commands and params check by themselves."""

    def __init__(
        self,
        radio: Radio,
        transfer: MissionTransfer,
        mission: MissionMode,
        params: ParamLink,
        commands: CommandLink,
        link_loss: LinkLossFailsafe,
        clock: VehicleClock,
        offboard: OffboardReceiver,
    ) -> None:
        self._radio = radio
        self._transfer = transfer
        self._mission = mission
        self._link_loss = link_loss
        self._clock = clock
        self._mission_handlers: dict[str, Handle] = {
            "MISSION_COUNT": transfer.on_count,
            "MISSION_ITEM_INT": transfer.on_item,
            "MISSION_ITEM": transfer.on_item,
            "MISSION_REQUEST_LIST": transfer.on_request_list,
            "MISSION_REQUEST_INT": transfer.on_request,
            "MISSION_REQUEST": transfer.on_request,
            "MISSION_ACK": transfer.on_ack,
            "MISSION_CLEAR_ALL": transfer.on_clear,
            "MISSION_SET_CURRENT": self._on_set_current,
        }
        self._handlers: dict[str, Handle] = {
            "HEARTBEAT": self._on_heartbeat,
            "COMMAND_LONG": commands.on_command,
            "COMMAND_INT": commands.on_command,
            "PARAM_REQUEST_LIST": params.on_request_list,
            "PARAM_REQUEST_READ": params.on_request_read,
            "PARAM_SET": params.on_set,
            "TIMESYNC": self._on_timesync,
            "PING": self._on_ping,
            **offboard.handlers(),
        }

    def receive(self, channel: Sender, message: Message) -> None:
        """One message from outside; unknown ones are ignored."""
        if self._radio.silent:
            return
        name = message.get_type()
        handler = self._handlers.get(name)
        if handler is not None:
            handler(channel, message)
            return
        handler = self._mission_handlers.get(name)
        if handler is None:
            return
        if message.target_system == self._radio.system_id and message.target_component in MISSION_COMPONENTS:
            handler(channel, message)

    def _on_heartbeat(self, channel: Sender, message: Message) -> None:
        if message.type == MAV_TYPE_GCS:
            self._radio.on_gcs_heartbeat(channel)
            self._link_loss.on_gcs_heartbeat()
            self._radio.forward(channel, message)

    def _on_set_current(self, _channel: Sender, message: Message) -> None:
        """MISSION_SET_CURRENT has no ack."""
        if self._transfer.busy:
            self._radio.text(Severity.CRITICAL, "WPM: IGN WP CURR CMD: Busy")
        elif not self._mission.set_current(message.seq, at_once=True):
            self._radio.text(Severity.CRITICAL, "WPM: WP CURR CMD: Not in list")

    def _on_timesync(self, channel: Sender, message: Message) -> None:
        """Answer a request with our own time, in ns."""
        if message.tc1 == 0:
            now_ns = int(self._clock.now_s * 1e9)
            self._radio.reply(channel, mavlink.MAVLink_timesync_message(now_ns, message.ts1))

    def _on_ping(self, channel: Sender, message: Message) -> None:
        if message.target_system == 0 and message.target_component == 0:
            partner = (message.get_srcSystem(), message.get_srcComponent())
            self._radio.reply(channel, mavlink.MAVLink_ping_message(message.time_usec, message.seq, *partner))
