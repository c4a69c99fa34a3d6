"""Commands that the autopilot gives itself: a mission's DO_ items and the grab at boot.

They show on the wire as COMMAND_LONG from the vehicle to itself. Their acks, by the payload deliverer on board or by a
component on the payload port, are addressed to the vehicle and do not reach a ground station.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from app.simulator.channel import Radio
from app.simulator.clock import VehicleClock
from app.simulator.dialect import mavlink
from app.simulator.external.component import PayloadPort
from app.simulator.navigator.context import Deployment
from app.simulator.navigator.gimbal import SENT_ONCE, Command
from app.simulator.payload import PayloadDeliverer
from app.simulator.wire import VEHICLE_COMPONENT, Cmd, Result

REPEATS_AFTER_S = (0.5, 1.5, 2.0)
"""confirmation 1, 2, 3 [06_quad_delivery_default]."""
BOOT_REPEATS_AFTER_S = (0.5, 1.0, 1.5)
BOOT_GRAB_S = 0.25
BOOT_ACK_S = 1.2
GARBAGE = -5.592216e14
"""PX4's grab at boot leaves param1 uninitialised."""

Params7 = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class _Repeat:
    due_s: float
    command: int
    confirmation: int
    params: Params7
    target: tuple[int, int]


class InternalCommands:
    """Issues them, executes them, and repeats them on the wire."""

    def __init__(
        self,
        radio: Radio,
        clock: VehicleClock,
        payload: PayloadDeliverer | None,
        port: PayloadPort,
        deployment: Deployment,
        actions: Mapping[int, Callable[[tuple[float, ...]], None]],
    ) -> None:
        self._radio = radio
        self._clock = clock
        self._payload = payload
        self._port = port
        self._deployment = deployment
        self._actions = actions
        """Command to what it does, given params 1 to 4."""
        self._repeats: list[_Repeat] = []
        self._boot_ack_due = False
        self._boot_grab_due = False

    def boot(self) -> None:
        """Power-up: the grab of a valid gripper is announced shortly after [17b_gripper_none: none]."""
        self._repeats.clear()
        self._boot_grab_due = self._boot_ack_due = self._payload is not None and self._payload.valid

    def issue(self, command: Command) -> None:
        """A mission item's command."""
        number, params = command
        seven = params + (0.0,) * (7 - len(params))
        self._announce(number, seven, (self._radio.system_id, 0), () if command in SENT_ONCE else REPEATS_AFTER_S)
        if number == Cmd.DO_GRIPPER and self._payload is not None:
            self._payload.command(params[1], self._deployment.on_result)
        self._port.issue(number, (seven[0], seven[1], seven[2], seven[3]), self._deployment.on_result)
        if number in self._actions:
            self._actions[number](params)

    def step(self) -> None:
        """Send the repeats that are due."""
        now_s = self._clock.now_s
        if self._boot_grab_due and now_s >= BOOT_GRAB_S:
            self._boot_grab_due = False
            params = (GARBAGE, 1.0, 0.0, 0.0, 0.0, 0.0, GARBAGE)
            self._announce(Cmd.DO_GRIPPER, params, (0, 0), BOOT_REPEATS_AFTER_S)
        if self._boot_ack_due and now_s >= BOOT_ACK_S:
            self._boot_ack_due = False
            ack = mavlink.MAVLink_command_ack_message(Cmd.DO_GRIPPER, Result.ACCEPTED, 0, 0, 0, VEHICLE_COMPONENT)
            self._radio.broadcast(ack)
        if self._repeats and now_s >= self._repeats[0].due_s:
            repeat = self._repeats.pop(0)
            self._send(repeat.command, repeat.confirmation, repeat.params, repeat.target)

    def _announce(
        self, command: int, params: Params7, target: tuple[int, int], repeats_after_s: tuple[float, ...]
    ) -> None:
        self._send(command, 0, params, target)
        for number, after_s in enumerate(repeats_after_s, start=1):
            self._repeats.append(_Repeat(self._clock.now_s + after_s, command, number, params, target))
        self._repeats.sort(key=lambda repeat: repeat.due_s)

    def _send(self, command: int, confirmation: int, params: Params7, target: tuple[int, int]) -> None:
        self._radio.broadcast(mavlink.MAVLink_command_long_message(*target, command, confirmation, *params))
