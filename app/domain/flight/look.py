"""An observation of a vehicle, and the evidence of a drop that it contains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from app.domain.drop.record import DropOutcome, DropPhase, DropRecord, OutputEvidence
from app.domain.drop.supervised_inputs import GRIPPER_CLOSED_US, GRIPPER_OPEN_US, Finish
from app.domain.geo import distance_m
from app.domain.mission import CompiledDrop, MavCmd
from app.domain.run.run import Asked
from app.domain.targets import TargetFix
from app.domain.vehicle.state import FlightMode, VehicleState

_ASKED = {Asked.PAUSE: FlightMode.HOLD, Asked.RETURN: FlightMode.RETURN, Asked.LAND: FlightMode.LAND}


@dataclass(frozen=True, slots=True)
class VehicleSnapshot:
    """An observation of the vehicle: its state, both clocks of the service, and the rate of the vehicle's clock.

    `clock_rate` is 1 until measured, about a second after the first position. `asked`: see FlightView. `is_changing`:
    another mission is on its way to the vehicle, or may be on board. `targets`: reports of moving targets, by feed.
    """

    state: VehicleState
    now_s: float
    time_s: float
    clock_rate: float
    rate_is_measured: bool = True
    asked: Asked | None = None
    is_changing: bool = False
    targets: Mapping[str, TargetFix] = field(default_factory=dict)

    @property
    def mode_for_drops(self) -> FlightMode | None:
        """A requested mode counts from the request on. Nothing is released before the vehicle has obeyed, nor while it
        is unknown which mission it flies.
        """
        if self.is_changing and self.state.mode is FlightMode.MISSION:
            return FlightMode.HOLD
        if self.asked is None or self.state.mode is not FlightMode.MISSION:
            return self.state.mode
        return _ASKED.get(self.asked, self.state.mode)


def offset_m(state: VehicleState, compiled: CompiledDrop) -> float | None:
    """Return the horizontal distance from the drop point; None without a position."""
    if state.latitude_deg is None or state.longitude_deg is None:
        return None
    return distance_m(state.latitude_deg, state.longitude_deg, compiled.latitude_deg, compiled.longitude_deg)


_MEASURED = (
    *("latitude_deg", "longitude_deg", "relative_altitude_m", "absolute_altitude_m", "heading_deg", "ground_speed_m_s"),
    *("landed", "gnss_fix", "gnss_satellites", "gnss_hdop", "battery_percent"),
)


def where(seen: VehicleSnapshot, compiled: CompiledDrop) -> dict[str, object]:
    """Return the position and its quality, as evidence."""
    measured: dict[str, object] = {name: getattr(seen.state, name) for name in _MEASURED}
    return {**measured, "offset_m": offset_m(seen.state, compiled)}


def commanded(record: DropRecord, attempt: int, seen: VehicleSnapshot, compiled: CompiledDrop) -> DropRecord:
    """Return the record with a release about to be sent."""
    changes: dict[str, object] = {"attempts": attempt, "commanded_at": seen.time_s, **where(seen, compiled)}
    return record.model_copy(update=changes)


def output_evidence(record: DropRecord, compiled: CompiledDrop, state: VehicleState) -> OutputEvidence | None:
    """Classify the gripper output for this drop. A drop that is not over can only be classified as unobservable."""
    if compiled.command is not MavCmd.DO_GRIPPER:
        return None
    if record.output_us == GRIPPER_OPEN_US and (record.supervised or record.outcome is DropOutcome.RELEASED):
        return OutputEvidence.MOVED
    was_free = record.output_evidence is OutputEvidence.NOT_ASSIGNED and state.has_gripper_output is None
    if state.has_gripper_output is False or was_free:
        return OutputEvidence.NOT_ASSIGNED
    if record.phase is not DropPhase.DONE or (record.supervised and record.commanded_at is None):
        return None
    if record.output_us == GRIPPER_CLOSED_US:
        return OutputEvidence.NOT_MOVED
    if record.output_us == GRIPPER_OPEN_US:
        return None  # open before its item
    return OutputEvidence.NOT_KNOWN if state.has_gripper_output is None else OutputEvidence.NOT_SEEN


def with_output(record: DropRecord, compiled: CompiledDrop, state: VehicleState) -> DropRecord:
    """Return the record with it."""
    return record.model_copy(update={"output_evidence": output_evidence(record, compiled, state)})


def finished(record: DropRecord, finish: Finish) -> DropRecord:
    """Return the record at its end."""
    return record.model_copy(
        update={
            "phase": DropPhase.DONE,
            "outcome": finish.outcome,
            "certainty": finish.certainty,
            "reason": finish.reason,
        }
    )


# The commands of the drops of a flight. A drop is identified by its leg and its plan item.


@dataclass(frozen=True, slots=True)
class ReleaseOrder:
    """Send a release of this drop now, as attempt number `attempt`."""

    plan_item_id: str
    attempt: int


@dataclass(frozen=True, slots=True)
class ResumeOrder:
    """Advance the mission to `seq` now, if it still waits at one of `waiting_at`."""

    seq: int
    waiting_at: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class DivertOrder:
    """The vehicle waits at this drop with its parcel: send it to the drop's alternate, at `seq`."""

    plan_item_id: str
    seq: int


@dataclass(frozen=True, slots=True)
class FailureOrder:
    """A drop did not end as released: do what the plan specifies ("return" or "hold")."""

    action: str
    plan_item_id: str


Order = ReleaseOrder | ResumeOrder | DivertOrder | FailureOrder


def failure_order(record: DropRecord, on_failure: str, state: VehicleState) -> FailureOrder | None:
    """Return what the plan specifies for a drop that just ended as not released; None if the mission continues.

    No command is sent to a vehicle that others have switched out of Mission mode, or without telemetry.
    """
    failed = record.phase is DropPhase.DONE and record.outcome is not DropOutcome.RELEASED
    commandable = state.connected and state.mode is FlightMode.MISSION
    if not failed or not commandable or on_failure == "continue":
        return None
    return FailureOrder(on_failure, record.plan_item_id)
