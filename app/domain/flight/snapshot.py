"""A snapshot of the vehicle, the evidence of a drop that is taken from it, and the commands of drops."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from app.domain.drop.record import DropOutcome, DropPhase, DropRecord, OutputEvidence
from app.domain.drop.supervised_inputs import GRIPPER_CLOSED_US, GRIPPER_OPEN_US, Finish
from app.domain.geo import distance_m
from app.domain.mission import CompiledDrop, MavCmd
from app.domain.run.run import HOLDS, RunAction
from app.domain.targets import TargetFix
from app.domain.vehicle.state import FlightMode, VehicleState

_MODE_OF = {
    **dict.fromkeys(HOLDS, FlightMode.HOLD),
    RunAction.RETURN: FlightMode.RETURN,
    RunAction.LAND: FlightMode.LAND,
}


@dataclass(frozen=True, slots=True)
class VehicleSnapshot:
    """The vehicle's state, both clocks of the service, and the rate of the vehicle's clock.

    `clock_rate` is 1 until it is measured, about a second after the first position. `commanded`: see Run.
    `is_changing`: another mission is being transferred or may be on board. `carries_other`: another client has replaced
    the mission. `home_moved_m`: how far up somebody has moved home in flight. `targets`: the moving targets of the
    drops, by feed.
    """

    state: VehicleState
    now_s: float
    time_s: float
    clock_rate: float
    rate_is_measured: bool = True
    commanded: RunAction | None = None
    is_changing: bool = False
    carries_other: bool = False
    home_moved_m: float = 0.0
    targets: Mapping[str, TargetFix] = field(default_factory=dict)

    @property
    def relative_altitude_m(self) -> float | None:
        """Above the home of the takeoff, from where the plan's altitudes count."""
        told_m = self.state.relative_altitude_m
        return None if told_m is None else told_m + self.home_moved_m

    @property
    def mode_for_drops(self) -> FlightMode | None:
        """A commanded mode counts from the command on. Nothing is released while the vehicle still obeys, nor while it
        is not known which mission it flies. A terminated one flies none, although PX4 shows the mode of before.
        """
        if self.state.is_terminated:
            return FlightMode.OTHER
        if (self.is_changing or self.carries_other) and self.state.mode is FlightMode.MISSION:
            return FlightMode.HOLD
        if self.commanded is None or self.state.mode is not FlightMode.MISSION:
            return self.state.mode
        return _MODE_OF.get(self.commanded, self.state.mode)


def offset_m(state: VehicleState, compiled: CompiledDrop) -> float | None:
    """Return the horizontal distance from the drop point; None without a position."""
    if state.latitude_deg is None or state.longitude_deg is None:
        return None
    return distance_m(state.latitude_deg, state.longitude_deg, compiled.latitude_deg, compiled.longitude_deg)


def height_error_m(seen: VehicleSnapshot, compiled: CompiledDrop) -> float | None:
    """Return how far the vehicle is above or below where it is to hover, in the plan's own frame; None if unknown."""
    for is_m, planned_m in (
        (seen.relative_altitude_m, compiled.relative_altitude_m),
        (seen.state.absolute_altitude_m, compiled.absolute_altitude_m),
    ):
        if is_m is not None and planned_m is not None:
            return abs(is_m - planned_m)
    return None


_MEASURED = (
    *("latitude_deg", "longitude_deg", "relative_altitude_m", "absolute_altitude_m", "heading_deg", "ground_speed_m_s"),
    *("landed", "gnss_fix", "gnss_satellites", "gnss_hdop", "battery_percent"),
)


def where(seen: VehicleSnapshot, compiled: CompiledDrop) -> dict[str, object]:
    """Where the vehicle is now and how well that is known, for the evidence."""
    measured: dict[str, object] = {name: getattr(seen.state, name) for name in _MEASURED}
    return {**measured, "relative_altitude_m": seen.relative_altitude_m, "offset_m": offset_m(seen.state, compiled)}


def with_command(record: DropRecord, attempt: int, seen: VehicleSnapshot, compiled: CompiledDrop) -> DropRecord:
    """The record with a release about to be sent."""
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
    return record.model_copy(update={"output_evidence": output_evidence(record, compiled, state)})


def finished(record: DropRecord, finish: Finish) -> DropRecord:
    return record.model_copy(
        update={
            "phase": DropPhase.DONE,
            "outcome": finish.outcome,
            "certainty": finish.certainty,
            "reason": finish.reason,
        }
    )


@dataclass(frozen=True, slots=True)
class ReleaseCommand:
    """Send a release of this drop now, as attempt number `attempt`."""

    plan_item_id: str
    attempt: int


@dataclass(frozen=True, slots=True)
class ResumeCommand:
    """Move the mission on to `seq` now, if it certainly still waits at this drop."""

    plan_item_id: str
    seq: int


@dataclass(frozen=True, slots=True)
class DivertCommand:
    """The vehicle waits at this drop with its parcel: send it to the drop's alternate, at `seq`."""

    plan_item_id: str
    seq: int


@dataclass(frozen=True, slots=True)
class ContingencyCommand:
    """A drop did not end as released: carry out the plan's contingency ("return" or "hold")."""

    action: str
    plan_item_id: str


DropCommand = ReleaseCommand | ResumeCommand | DivertCommand | ContingencyCommand


def is_order(commanded: RunAction | None) -> bool:
    """Whether the vehicle has been told to hold, return or land."""
    return commanded in _MODE_OF


def contingency_command(record: DropRecord, on_failure: str, seen: VehicleSnapshot) -> ContingencyCommand | None:
    """Return the contingency of a drop that ended otherwise than released; None if the mission continues.

    Nothing is commanded if somebody else changed the mode or the mission, the flight was terminated, or the link is
    lost.
    """
    failed = record.phase is DropPhase.DONE and record.outcome is not DropOutcome.RELEASED
    is_heard = seen.state.connected and not seen.carries_other and not seen.state.is_terminated
    commandable = is_heard and seen.state.mode is FlightMode.MISSION
    if not failed or not commandable or on_failure == "continue":
        return None
    return ContingencyCommand(on_failure, record.plan_item_id)
