"""What the drops of a flight order to be sent. A drop is named by the leg it belongs to and its plan item."""

from __future__ import annotations

from dataclasses import dataclass

from app.domain.drop import DropOutcome, DropPhase, DropRecord
from app.domain.vehicle import FlightMode, VehicleState


@dataclass(frozen=True, slots=True)
class ReleaseOrder:
    """Send a release of this drop now, as attempt number `attempt`."""

    plan_item_id: str
    attempt: int


@dataclass(frozen=True, slots=True)
class ResumeOrder:
    """Move the mission on to `seq` now, if it still waits at one of `waiting_at`."""

    seq: int
    waiting_at: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class DivertOrder:
    """The vehicle waits at this drop with its parcel: send it to the drop's alternate, at `seq`."""

    plan_item_id: str
    seq: int


@dataclass(frozen=True, slots=True)
class FailureOrder:
    """A drop did not end released: do now what the plan says of that ("return" or "hold")."""

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
