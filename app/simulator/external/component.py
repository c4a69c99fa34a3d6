"""The face of a payload component towards the port it hangs on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from app.simulator.channel import Radio, Sender
from app.simulator.clock import VehicleClock
from app.simulator.dialect import Message, mavlink
from app.simulator.faults import VehicleFaults
from app.simulator.geo import LocalFrame
from app.simulator.state import VehicleState
from app.simulator.wire import Result

Params4 = tuple[float, float, float, float]
Answer = Callable[[Result], None]
"""Called with every result for the one who asked: IN_PROGRESS first, then the final one."""


@dataclass(frozen=True, slots=True)
class Mount:
    """What a component knows of the vehicle that carries it."""

    state: VehicleState
    frame: LocalFrame
    clock: VehicleClock
    radio: Radio


class PayloadComponent(Protocol):
    """A device of its own: it has its own power and its state outlives a reboot of the autopilot."""

    component_id: int
    mav_type: int
    """MAV_TYPE of its heartbeat."""
    command: int
    """The MAV_CMD that it executes."""

    def execute(self, params: Params4, answer: Answer) -> None:
        """Params 1 to 4 of its command."""

    def step(self) -> None:
        """One step of vehicle time."""

    def status(self) -> Message | None:
        """What it reports once a second, if anything."""


# The serial port of an autopilot with payload components on it.
#
# PX4 sends its own vehicle commands out as COMMAND_LONG, forwards what a ground station sends to another component,
# and takes a component's COMMAND_ACK as the answer to its own command. An ack for the autopilot goes no further: a
# ground station hears the acks of its own commands only.


AUTOPILOT_INVALID = 8
STATE_ACTIVE = 4
STATUS_S = 1.0
PROGRESS_UNKNOWN = 255


class PayloadPort:
    """Carries commands to the components and their acks back."""

    def __init__(
        self, radio: Radio, clock: VehicleClock, faults: VehicleFaults, components: Sequence[PayloadComponent]
    ) -> None:
        self._radio = radio
        self._faults = faults
        self._clock = clock
        self._components = tuple(components)
        self._due_s = STATUS_S

    def boot(self) -> None:
        """The autopilot restarts; the components go on as they were."""
        self._due_s = STATUS_S

    def issue(self, command: int, params: Params4, heard: Callable[[Result], None]) -> None:
        """A command of the autopilot itself, to all components; `heard` gets the acks."""
        for component in self._components:
            if component.command == command:
                component.execute(params, heard)

    def on_command(self, channel: Sender, message: Message) -> None:
        """COMMAND_LONG from a ground station: to one component, or to all."""
        if message.target_system not in (0, self._radio.system_id):
            return
        for component in self._components:
            for_it = message.target_component in (0, component.component_id)
            if for_it and message.command == component.command:
                self._execute(component, channel, message)

    def step(self) -> None:
        """One step of every component; once a second heartbeats and reports."""
        for component in self._components:
            component.step()
        if self._clock.now_s < self._due_s:
            return
        self._due_s = self._clock.now_s + STATUS_S
        for component in self._components:
            heartbeat = mavlink.MAVLink_heartbeat_message(component.mav_type, AUTOPILOT_INVALID, 0, 0, STATE_ACTIVE, 3)
            self._radio.broadcast(heartbeat, component.component_id)
            status = component.status()
            if status is not None:
                self._radio.broadcast(status, component.component_id)

    def _execute(self, component: PayloadComponent, channel: Sender, message: Message) -> None:
        asker = (message.get_srcSystem(), message.get_srcComponent())

        def acknowledge(result: Result) -> None:
            if result is not Result.IN_PROGRESS and self._faults.take_lost_ack():
                return
            progress = PROGRESS_UNKNOWN if result is Result.IN_PROGRESS else 0
            ack = mavlink.MAVLink_command_ack_message(component.command, result, progress, 0, *asker)
            self._radio.reply(channel, ack, component.component_id)

        component.execute((message.param1, message.param2, message.param3, message.param4), acknowledge)
