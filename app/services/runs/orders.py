"""What a drop orders to be sent, and what every drop of a flight can do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from app.domain.commands import CommandAck
from app.domain.drop import DropOutcome, DropPhase, DropRecord
from app.domain.mission import CompiledDrop
from app.domain.progress import Progress
from app.domain.reason import Reason
from app.domain.supervised import DropMachine, Observation
from app.domain.vehicle import FlightMode, VehicleState
from app.services.runs.evidence import Look


class Release(Protocol):
    """One drop of a flight."""

    compiled: CompiledDrop
    record: DropRecord

    @property
    def is_over(self) -> bool:
        """Whether it has its outcome."""

    @property
    def is_active(self) -> bool:
        """Whether the vehicle waits at it now."""

    @property
    def is_busy(self) -> bool:
        """Whether it was commanded, or its item passed, and what came of it is not known yet."""

    def look(self, seen: Look, progress: Progress) -> tuple[Order, ...]:
        """Look at the vehicle; the orders must be carried out."""

    def end(self, reason: Reason, now_s: float) -> None:
        """The run ends: close with what is known."""


class CommandedRelease(Release, Protocol):
    """A drop that Waydrop commands itself, and which hears the answers."""

    machine: DropMachine

    @property
    def awaits_answer(self) -> bool:
        """Whether a release was sent whose final ack is still awaited."""

    def observe(self, seen: Look) -> Observation:
        """What the drop's machine is told of a look."""

    def acked(self, attempt: int, ack: CommandAck, seen: Look) -> Sequence[Order]:
        """A COMMAND_ACK of one release."""

    def timed_out(self, attempt: int, seen: Look) -> Sequence[Order]:
        """No final ack came."""

    def withheld(self, attempt: int, seen: Look) -> Sequence[Order]:
        """The release was not sent after all."""


@dataclass(frozen=True, slots=True)
class ReleaseOrder:
    """What must be sent now: a release of this drop."""

    drop: CommandedRelease
    attempt: int


@dataclass(frozen=True, slots=True)
class ResumeOrder:
    """What must be sent now: the mission moves on to `seq`, if it still waits at one of `waiting_at`."""

    seq: int
    waiting_at: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class DivertOrder:
    """What must be sent now: the vehicle, which waits at `drop` with its parcel, goes to the alternate at `seq`."""

    drop: CommandedRelease
    seq: int


@dataclass(frozen=True, slots=True)
class FailureOrder:
    """What must be sent now: a drop did not end released, and the plan says what then ("return" or "hold")."""

    action: str
    plan_item_id: str


Order = ReleaseOrder | ResumeOrder | DivertOrder | FailureOrder


def failure_order(record: DropRecord, on_failure: str, state: VehicleState) -> FailureOrder | None:
    """What the plan says of a drop that has just ended otherwise than released; None if the mission simply goes on.

    Nothing is ordered to a vehicle that somebody else has taken out of Mission mode, or that cannot be heard.
    """
    failed = record.phase is DropPhase.DONE and record.outcome is not DropOutcome.RELEASED
    commandable = state.connected and state.mode is FlightMode.MISSION
    if not failed or not commandable or on_failure == "continue":
        return None
    return FailureOrder(on_failure, record.plan_item_id)
