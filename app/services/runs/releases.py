"""The supervised and embedded drops of one flight: they look, decide by their pure machines, and keep the evidence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from app.domain.commands import CommandAck
from app.domain.drop import DropOutcome, DropPhase, DropRecord
from app.domain.embedded_drop import EmbeddedDrop, EmbeddedSight
from app.domain.geo import distance_m
from app.domain.mission import CompiledDrop, MavCmd
from app.domain.progress import Progress
from app.domain.supervised import (
    DropMachine,
    DropTerms,
    Finish,
    Observation,
    ReleaseAck,
    ReleaseTimedOut,
    ReleaseWithheld,
    Resume,
    RunEnding,
    SendRelease,
    step,
)
from app.domain.supervised.inputs import DropInput
from app.domain.vehicle import FlightMode, VehicleState


@dataclass(frozen=True, slots=True)
class Look:
    """One look at the vehicle: the state, our two clocks, and how fast the vehicle's own clock runs."""

    state: VehicleState
    now_s: float
    time_s: float
    clock_rate: float


@dataclass(frozen=True, slots=True)
class ReleaseOrder:
    """What must be sent now: a release of this drop."""

    drop: SupervisedRelease
    attempt: int


@dataclass(frozen=True, slots=True)
class ResumeOrder:
    """What must be sent now: the mission moves on to `seq`."""

    seq: int


@dataclass(frozen=True, slots=True)
class FailureOrder:
    """What must be sent now: a drop did not end released, and the plan says what then ("return" or "hold")."""

    action: str
    plan_item_id: str


Order = ReleaseOrder | ResumeOrder | FailureOrder


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

    def look(self, seen: Look, progress: Progress) -> tuple[Order, ...]:
        """Look at the vehicle; the orders must be carried out."""

    def end(self, reason: str, now_s: float) -> None:
        """The run ends: close with what is known."""


class SupervisedRelease:
    """A drop that Waydrop commands itself."""

    def __init__(self, compiled: CompiledDrop, record: DropRecord, max_offset_m: float, on_failure: str) -> None:
        self.compiled = compiled
        self.record = record
        self._on_failure = on_failure
        terms = DropTerms.of(compiled, max_offset_m)
        self.machine = DropMachine.taken_up(terms, record.attempts)

    @property
    def is_over(self) -> bool:
        """See Release."""
        return self.machine.is_over or self.record.phase is DropPhase.DONE

    @property
    def is_active(self) -> bool:
        """See Release."""
        return not self.is_over and self.machine.phase in (DropPhase.HOLDING, DropPhase.RELEASING)

    @property
    def awaits_answer(self) -> bool:
        """Whether a release was sent whose final ack is still awaited."""
        return self.machine.in_flight is not None

    def look(self, seen: Look, progress: Progress) -> tuple[Order, ...]:
        """See Release."""
        return self._hear(self.observe(seen), seen)

    def observe(self, seen: Look) -> Observation:
        """What the machine is told of a look."""
        state, has_gripper = seen.state, self.compiled.command is MavCmd.DO_GRIPPER
        return Observation(
            now_s=seen.now_s,
            connected=state.connected,
            mode=state.mode,
            armed=state.armed,
            in_failsafe=state.in_failsafe,
            landed=state.landed,
            mission_seq=state.mission_seq,
            boot_s=state.boot_time_s,
            clock_rate=seen.clock_rate,
            offset_m=offset_m(state, self.compiled),
            ground_speed_m_s=state.ground_speed_m_s,
            position_age_s=state.position_age_s,
            gripper_output_us=state.gripper_output_us if has_gripper else None,
            gripper_output_age_s=state.gripper_output_age_s if has_gripper else None,
        )

    def acked(self, attempt: int, ack: CommandAck, seen: Look) -> tuple[Order, ...]:
        """A COMMAND_ACK of one release."""
        changes = {"acknowledged_result": ack.word}
        if ack.is_final:
            self.record = self.record.model_copy(update={**changes, "acknowledged_at": seen.time_s})
        return self._hear(ReleaseAck(seen.now_s, attempt, ack), seen)

    def timed_out(self, attempt: int, seen: Look) -> tuple[Order, ...]:
        """No final ack came."""
        return self._hear(ReleaseTimedOut(seen.now_s, attempt), seen)

    def withheld(self, attempt: int, seen: Look) -> tuple[Order, ...]:
        """The release was not sent after all."""
        return self._hear(ReleaseWithheld(seen.now_s, attempt), seen)

    def end(self, reason: str, now_s: float) -> None:
        """See Release."""
        self.machine, effects = step(self.machine, RunEnding(now_s, reason))
        self._take(effects)

    def _hear(self, heard: DropInput, seen: Look) -> tuple[Order, ...]:
        if self.machine.is_over:
            return ()
        before = self.machine.phase
        self.machine, effects = step(self.machine, heard)
        if self.machine.phase is not before and self.machine.phase is not DropPhase.DONE:
            self.record = self.record.model_copy(update={"phase": self.machine.phase})
        for effect in effects:
            if isinstance(effect, SendRelease):
                self.record = commanded(self.record, effect.attempt, seen, self.compiled)
        output = seen.state.gripper_output_us
        if self.record.commanded_at is not None and output is not None and output != self.record.output_us:
            self.record = self.record.model_copy(update={"output_us": output, "output_at": seen.time_s})
        self._take(effects)
        if failure := failure_order(self.record, self._on_failure, seen.state):
            return (failure,)  # instead of moving on
        sends = [ReleaseOrder(self, e.attempt) for e in effects if isinstance(e, SendRelease)]
        return (*sends, *(ResumeOrder(e.seq) for e in effects if isinstance(e, Resume)))

    def _take(self, effects: tuple[object, ...]) -> None:
        for effect in effects:
            if isinstance(effect, Finish):
                self.record = finished(self.record, effect)


class EmbeddedRelease:
    """A drop that is an item of the mission: it is only watched."""

    def __init__(self, compiled: CompiledDrop, record: DropRecord, on_failure: str) -> None:
        self.compiled = compiled
        self.record = record
        self._on_failure = on_failure
        self._drop = EmbeddedDrop()

    @property
    def is_over(self) -> bool:
        """See Release."""
        return self.record.phase is DropPhase.DONE

    @property
    def is_active(self) -> bool:
        """See Release."""
        return False

    def look(self, seen: Look, progress: Progress) -> tuple[Order, ...]:
        """See Release."""
        if self.is_over:
            return ()
        state = seen.state
        has_gripper = self.compiled.command is MavCmd.DO_GRIPPER
        passed = self.compiled.release_seq is not None and progress.passed_to >= self.compiled.release_seq
        before = self._drop
        self._drop = before.saw(
            EmbeddedSight(
                now_s=seen.now_s,
                connected=state.connected,
                passed=passed,
                output_us=state.gripper_output_us if has_gripper else None,
                output_age_s=state.gripper_output_age_s if has_gripper else None,
            )
        )
        first_pass = self._drop.passed_at_s is not None and before.passed_at_s is None
        if first_pass or (self._drop.finish is not None and self.record.offset_m is None):
            self.record = self.record.model_copy(update=where(seen, self.compiled))
        if self._drop.finish is not None:
            changes = {"output_us": state.gripper_output_us, "output_at": seen.time_s} if has_gripper else {}
            self.record = finished(self.record.model_copy(update=changes), self._drop.finish)
            failure = failure_order(self.record, self._on_failure, state)
            return (failure,) if failure else ()
        return ()

    def end(self, reason: str, now_s: float) -> None:
        """See Release."""
        self._drop = self._drop.ended(reason)
        if self._drop.finish is not None and not self.is_over:
            self.record = finished(self.record, self._drop.finish)


def failure_order(record: DropRecord, on_failure: str, state: VehicleState) -> FailureOrder | None:
    """What the plan says of a drop that has just ended otherwise than released; None if the mission simply goes on.

    Nothing is ordered to a vehicle that somebody else has taken out of Mission mode, or that cannot be heard.
    """
    failed = record.phase is DropPhase.DONE and record.outcome is not DropOutcome.RELEASED
    commandable = state.connected and state.mode is FlightMode.MISSION
    if not failed or not commandable or on_failure == "continue":
        return None
    return FailureOrder(on_failure, record.plan_item_id)


def offset_m(state: VehicleState, compiled: CompiledDrop) -> float | None:
    """Horizontal distance of the vehicle from the drop point; None without a position."""
    if state.latitude_deg is None or state.longitude_deg is None:
        return None
    return distance_m(state.latitude_deg, state.longitude_deg, compiled.latitude_deg, compiled.longitude_deg)


def where(seen: Look, compiled: CompiledDrop) -> dict[str, float | None]:
    """Where the vehicle is at this look, for the evidence."""
    state = seen.state
    return {
        "latitude_deg": state.latitude_deg,
        "longitude_deg": state.longitude_deg,
        "relative_altitude_m": state.relative_altitude_m,
        "ground_speed_m_s": state.ground_speed_m_s,
        "offset_m": offset_m(state, compiled),
    }


def commanded(record: DropRecord, attempt: int, seen: Look, compiled: CompiledDrop) -> DropRecord:
    """The record with a release about to be sent."""
    changes = {"attempts": attempt, "commanded_at": seen.time_s, **where(seen, compiled)}
    return record.model_copy(update=changes)


def finished(record: DropRecord, finish: Finish) -> DropRecord:
    """The record at its end."""
    return record.model_copy(
        update={
            "phase": DropPhase.DONE,
            "outcome": finish.outcome,
            "certainty": finish.certainty,
            "reason": finish.reason,
        }
    )
