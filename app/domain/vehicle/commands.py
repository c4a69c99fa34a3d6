"""The ack state machine of one command: IN_PROGRESS extends the deadline, a final result closes it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Annotated, Final

from pydantic import BeforeValidator, PlainSerializer, WithJsonSchema

from app.domain.mission import MavCmd


class MavResult(IntEnum):
    """MAV_RESULT. The raw value is always kept; an ack is never reduced to a bool."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5
    CANCELLED = 6
    COMMAND_LONG_ONLY = 7
    COMMAND_INT_ONLY = 8
    COMMAND_UNSUPPORTED_MAV_FRAME = 9


def _by_name(value: object) -> object:
    return MavResult[value] if isinstance(value, str) and value in MavResult.__members__ else value


MavResultName = Annotated[
    MavResult,
    BeforeValidator(_by_name),
    PlainSerializer(lambda result: result.name, return_type=str),
    WithJsonSchema({"type": "string", "enum": [result.name for result in MavResult]}),
]
"""A MAV_RESULT that is stored and sent by its name."""


@dataclass(frozen=True, slots=True)
class CommandRequest:
    """One COMMAND_LONG. `params` are param1..7; NaN means "not given".

    `place`: latitude and longitude in 1e7 degrees instead of param5 and 6, which makes it a COMMAND_INT in
    MAV_FRAME_GLOBAL: as a float a longitude can be off by a metre.

    `attempts` counts sends without any acknowledgement, `timeout_s` is the wait after each. A release is sent once per
    request: the state machine of the drop decides on another attempt. `sent_before` counts the sends of earlier
    requests of the same command that nobody answered: an error names all. `send_before_s` is the monotonic time after
    which the command must not be sent, however long it had to wait.
    """

    command: MavCmd
    params: tuple[float, float, float, float, float, float, float]
    timeout_s: float = 1.0
    attempts: int = 3
    in_progress_timeout_s: float = 10.0
    sent_before: int = 0
    send_before_s: float | None = None
    place: tuple[int, int] | None = None


@dataclass(frozen=True, slots=True)
class CommandAck:
    """One COMMAND_ACK to us. `result_code` is raw: an unknown MAV_RESULT is kept as it came."""

    command: int
    result_code: int
    progress: int | None = None

    @property
    def result(self) -> MavResult | None:
        """The MAV_RESULT, or None if the vehicle sent a number that MAVLink does not know."""
        return MavResult(self.result_code) if self.result_code in MavResult._value2member_map_ else None

    @property
    def word(self) -> str:
        """The result as text, for events and messages."""
        return self.result.name if self.result is not None else f"MAV_RESULT {self.result_code}"

    @property
    def is_final(self) -> bool:
        """Whether nothing follows."""
        return self.result is not MavResult.IN_PROGRESS


LATE_S: Final = 3.0
"""A command is not repeated so long after it should have been."""


def is_late(due_s: float, now_s: float, every_s: float = 0.0) -> bool:
    """Whether what should have been repeated at `due_s` is not any more: the process stood still, and the vehicle may
    be elsewhere, or another gateway's.
    """
    return now_s >= due_s + max(LATE_S, every_s)


@dataclass(frozen=True, slots=True)
class PendingCommand:
    """A pending command. Times are monotonic seconds.

    Invariant: it ends once, by its first final acknowledgement or by a deadline, and does not change after that.
    """

    request: CommandRequest
    deadline_s: float
    sends: int = 1
    in_progress: bool = False
    final: CommandAck | None = None
    timed_out: bool = False

    @classmethod
    def sent(cls, request: CommandRequest, now_s: float) -> PendingCommand:
        """The state at the first send; `now_s` is from before it, for the process may stand still in between."""
        return cls(request=request, deadline_s=now_s + request.timeout_s)

    @property
    def is_over(self) -> bool:
        """Whether a final acknowledgement or the last deadline has come."""
        return self.final is not None or self.timed_out

    def acked(self, ack: CommandAck, now_s: float) -> PendingCommand:
        """The state after an ack; acks of other commands and acks after the end change nothing."""
        if self.is_over or ack.command != self.request.command:
            return self
        if ack.is_final:
            return replace(self, final=ack)
        return replace(self, in_progress=True, deadline_s=now_s + self.request.in_progress_timeout_s)

    def ticked(self, now_s: float) -> tuple[PendingCommand, bool]:
        """The state at `now_s`, and whether the command must be sent again now.

        A command that is in progress is never sent again: PX4 would answer TEMPORARILY_REJECTED. Neither is one whose
        time to repeat it has passed: the process stood still, and the vehicle may be elsewhere.
        """
        if self.is_over or now_s < self.deadline_s:
            return self, False
        late = is_late(self.deadline_s, now_s, self.request.timeout_s)
        if self.in_progress or self.sends >= self.request.attempts or late:
            return replace(self, timed_out=True), False
        return replace(self, sends=self.sends + 1, deadline_s=now_s + self.request.timeout_s), True
