"""What a supervised drop hears (observations, acks) and what it asks for (effects)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.domain.commands import CommandAck
from app.domain.drop import Certainty, DropOutcome
from app.domain.reason import Reason
from app.domain.vehicle import FlightMode, LandedState

OUTPUT_FRESH_S: Final = 2.0


@dataclass(frozen=True, slots=True)
class TargetSight:
    """What is known of a drop's moving target: how old that is, how far from the vehicle it is now, how fast."""

    age_s: float
    distance_m: float | None
    speed_m_s: float


@dataclass(frozen=True, slots=True)
class Observation:
    """What is known of the vehicle at `now_s` (our monotonic clock, seconds).

    `boot_s` is the vehicle's clock at its newest position, `clock_rate` how many of its seconds pass in one of ours
    (1 on a real vehicle). `offset_m` is the horizontal distance from the drop point. `target`: None if nothing was
    reported of it, or the drop has none.
    """

    now_s: float
    connected: bool
    mode: FlightMode | None
    armed: bool | None
    in_failsafe: bool
    landed: LandedState
    mission_seq: int | None
    boot_s: float | None
    clock_rate: float
    offset_m: float | None
    ground_speed_m_s: float | None
    position_age_s: float | None
    gripper_output_us: int | None = None
    gripper_output_age_s: float | None = None
    target: TargetSight | None = None

    @property
    def fresh_output_us(self) -> int | None:
        """The gripper's output if it is known and no older than 2 s."""
        if self.gripper_output_age_s is None or self.gripper_output_age_s > OUTPUT_FRESH_S:
            return None
        return self.gripper_output_us


def output_of(seen: Observation | None) -> int | None:
    """The gripper's output, if it is known and fresh."""
    return None if seen is None else seen.fresh_output_us


@dataclass(frozen=True, slots=True)
class ReleaseAck:
    """A COMMAND_ACK of our release number `attempt`."""

    now_s: float
    attempt: int
    ack: CommandAck


@dataclass(frozen=True, slots=True)
class ReleaseTimedOut:
    """No final ack of release number `attempt` came in time: nobody knows what the vehicle did."""

    now_s: float
    attempt: int


@dataclass(frozen=True, slots=True)
class ReleaseWithheld:
    """Release number `attempt` was surely not sent: by the time it was recorded, it was not right any more."""

    now_s: float
    attempt: int


@dataclass(frozen=True, slots=True)
class ConsentGiven:
    """An operator answered question number `question`."""

    now_s: float
    question: int
    grant: bool


@dataclass(frozen=True, slots=True)
class Silence:
    """Nothing is heard of the vehicle, but time goes by: a question does not wait for it."""

    now_s: float


@dataclass(frozen=True, slots=True)
class RunEnding:
    """The run ends now (landed, aborted, lost, rebooted): the drop must end in a known state."""

    now_s: float
    reason: Reason


DropInput = Observation | ReleaseAck | ReleaseTimedOut | ReleaseWithheld | ConsentGiven | Silence | RunEnding


@dataclass(frozen=True, slots=True)
class SendRelease:
    """Send the release once, as attempt number `attempt` (from 1)."""

    attempt: int


@dataclass(frozen=True, slots=True)
class Resume:
    """Move the mission on to `seq`. If it fails, the bounded hold ends by itself."""

    seq: int


@dataclass(frozen=True, slots=True)
class Divert:
    """The parcel is surely on board: send the vehicle to the alternate, at `seq`. If it fails, the mission goes on."""

    seq: int


@dataclass(frozen=True, slots=True)
class Finish:
    """The drop is over. Emitted exactly once."""

    outcome: DropOutcome
    certainty: Certainty
    reason: Reason


DropEffect = SendRelease | Resume | Divert | Finish
