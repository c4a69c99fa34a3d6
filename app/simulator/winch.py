"""An external payload: a winch with its own component id that receives DO_WINCH and acknowledges by itself.

No autopilot executes DO_WINCH; this is how a real one is attached (component 169, heartbeat, WINCH_STATUS).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

from app.simulator.clock import VehicleClock
from app.simulator.dialect import Message, mavlink
from app.simulator.radio import Radio, Sender
from app.simulator.wire import Cmd, Result

WINCH_COMPONENT = 169
MAV_TYPE_WINCH = 42
AUTOPILOT_INVALID = 8
DEFAULT_RATE_M_S = 1.0
FULL_LENGTH_M = 20.0
PAYLOAD_RELEASE_S = 0.5
STATUS_HEALTHY, STATUS_FULLY_RETRACTED, STATUS_MOVING, STATUS_LOCKED = 1, 2, 4, 16
PROGRESS_UNKNOWN = 255

Answer = Callable[[Result], None]


class Action(IntEnum):
    """WINCH_ACTIONS."""

    RELAXED = 0
    RELATIVE_LENGTH = 1
    RATE = 2
    LOCK = 3
    DELIVER = 4
    HOLD = 5
    RETRACT = 6
    LOAD_LINE = 7
    ABANDON_LINE = 8
    LOAD_PAYLOAD = 9


@dataclass(slots=True)
class _Motion:
    action: Action
    target_m: float
    rate_m_s: float
    answer: Answer
    then_retract: bool = False
    pause_until_s: float | None = None


class Winch:
    """Lets out and takes in line at a rate; `stuck` makes it fail."""

    def __init__(self, radio: Radio, clock: VehicleClock) -> None:
        self._radio = radio
        self._clock = clock
        self._motion: _Motion | None = None
        self._due_s = 1.0
        self.line_m = 0.0
        self.delivered = False
        self.stuck = False

    def boot(self) -> None:
        """Power-up: the line stays as it is."""
        self._motion = None
        self._due_s = 1.0

    def on_command(self, channel: Sender, message: Message) -> None:
        """COMMAND_LONG to this component, or to all."""
        if message.target_system not in (0, self._radio.system_id) or message.command != Cmd.DO_WINCH:
            return
        if message.target_component not in (0, WINCH_COMPONENT):
            return
        source = (message.get_srcSystem(), message.get_srcComponent())
        self.execute(message.param2, message.param3, message.param4, lambda result: self._ack(channel, source, result))

    def execute(self, action: float, length_m: float, rate_m_s: float, answer: Answer) -> None:
        """DO_WINCH: param2, param3, param4."""
        try:
            wanted = Action(int(action))
        except ValueError:
            answer(Result.DENIED)
            return
        if self._motion is not None and self._motion.action == wanted:
            answer(Result.TEMPORARILY_REJECTED)
            return
        if self._motion is not None:
            self._motion.answer(Result.CANCELLED)
            self._motion = None
        rate = abs(rate_m_s) or DEFAULT_RATE_M_S
        if wanted is Action.RELATIVE_LENGTH:
            self._start(wanted, self.line_m + length_m, rate, answer)
        elif wanted is Action.RATE:
            self._start(wanted, FULL_LENGTH_M if rate_m_s > 0.0 else 0.0, rate, answer)
        elif wanted is Action.DELIVER:
            depth_m = length_m if length_m > 0.0 else FULL_LENGTH_M / 2.0
            self._start(wanted, depth_m, rate, answer, then_retract=True)
        elif wanted is Action.RETRACT:
            self._start(wanted, 0.0, rate, answer)
        else:
            answer(Result.ACCEPTED)

    def step(self) -> None:
        """Move the line; heartbeat and status once a second."""
        if self._motion is not None:
            self._move(self._motion)
        if self._clock.now_s >= self._due_s:
            self._due_s = self._clock.now_s + 1.0
            heartbeat = mavlink.MAVLink_heartbeat_message(MAV_TYPE_WINCH, AUTOPILOT_INVALID, 0, 0, 4, 3)
            self._radio.broadcast(heartbeat, WINCH_COMPONENT)
            self._radio.broadcast(self._status(), WINCH_COMPONENT)

    def _start(
        self, action: Action, target_m: float, rate_m_s: float, answer: Answer, then_retract: bool = False
    ) -> None:
        if self.stuck:
            answer(Result.FAILED)
            return
        target_m = max(0.0, min(FULL_LENGTH_M, target_m))
        self._motion = _Motion(action, target_m, rate_m_s, answer, then_retract)
        answer(Result.IN_PROGRESS)

    def _move(self, motion: _Motion) -> None:
        if motion.pause_until_s is not None:
            if self._clock.now_s < motion.pause_until_s:
                return
            self.delivered = True
            motion.pause_until_s, motion.target_m, motion.then_retract = None, 0.0, False
        step_m = motion.rate_m_s * VehicleClock.STEP_S
        missing_m = motion.target_m - self.line_m
        self.line_m += max(-step_m, min(step_m, missing_m))
        if abs(motion.target_m - self.line_m) > 1e-6:
            return
        if motion.then_retract:
            motion.pause_until_s = self._clock.now_s + PAYLOAD_RELEASE_S
        else:
            self._motion = None
            motion.answer(Result.ACCEPTED)

    def _status(self) -> Message:
        flags = STATUS_HEALTHY
        if self.line_m <= 0.0:
            flags |= STATUS_FULLY_RETRACTED
        flags |= STATUS_MOVING if self._motion is not None else STATUS_LOCKED
        speed = self._motion.rate_m_s if self._motion is not None else 0.0
        return mavlink.MAVLink_winch_status_message(
            int(self._clock.now_s * 1e6), self.line_m, speed, 0.0, 16.2, 0.0, 25, flags
        )

    def _ack(self, channel: Sender, source: tuple[int, int], result: Result) -> None:
        progress = PROGRESS_UNKNOWN if result is Result.IN_PROGRESS else 0
        message = mavlink.MAVLink_command_ack_message(Cmd.DO_WINCH, result, progress, 0, *source)
        self._radio.reply(channel, message, WINCH_COMPONENT)
