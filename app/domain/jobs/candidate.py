"""A candidate: one vehicle that was looked at for a job, with every reason against it."""

from __future__ import annotations

from enum import StrEnum
from typing import Final

from pydantic import BaseModel, ConfigDict

from app.domain.reason import Reason

MOST_REFUSALS: Final = 20


class VehicleRefusal(StrEnum):
    """Stable codes of what speaks against a vehicle now. What speaks against its flying the plan has a rule's code."""

    UNKNOWN = "vehicle.unknown"
    """It has not been seen since Waydrop started."""
    NOT_ALLOWED = "vehicle.not_allowed"
    """The job names other vehicles."""
    QUARANTINED = "vehicle.quarantined"
    """Two vehicles answer to its system id."""
    DISCONNECTED = "vehicle.disconnected"
    """Its link is lost."""
    SILENT = "vehicle.silent"
    """It does not tell its type or its parameters."""
    BUSY = "vehicle.busy"
    """It has a run, or another job."""
    LEASED = "vehicle.leased"
    """Somebody has its offboard lease."""
    ARMED = "vehicle.armed"
    """It is armed, or does not tell."""
    NOT_LANDED = "vehicle.not_landed"
    """It is not on the ground, or does not tell."""
    IN_FAILSAFE = "vehicle.in_failsafe"
    """It acts on a failsafe."""
    QUEUE_STOPPED = "vehicle.queue_stopped"
    """Its queue is stopped until an operator says go on."""
    BATTERY_LOW = "vehicle.battery_low"
    """It has less battery than the job asks for."""
    BATTERY_UNKNOWN = "vehicle.battery_unknown"
    """It does not tell its battery, and the job asks for some."""


class Refusal(BaseModel):
    """One reason. `code` is a VehicleRefusal or a rule's; `pointer` leads into the plan, null if it is not about it.
    `reason` is why the vehicle's queue is stopped, if it is.

    `lasting`: waiting alone does not mend it, nor does a full battery, nor a flight to where the plan begins.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    code: str
    message: str
    reason: Reason | None = None
    hint: str = ""
    pointer: str | None = None
    lasting: bool = False


class Candidate(BaseModel):
    """One vehicle. It can have the job if `refusals` is empty. `reason` says why it was chosen, or why another was.

    `distance_m`: from where it is to where the plan begins, null if either is not known. At most MOST_REFUSALS are
    listed; `refusals_left_out` counts the others. `lasting`: one of all is, so waiting alone gives it no job.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    vehicle_id: str
    chosen: bool = False
    reason: Reason | None = None
    distance_m: float | None = None
    battery_percent: float | None = None
    refusals: tuple[Refusal, ...] = ()
    refusals_left_out: int = 0
    lasting: bool = False

    @property
    def can(self) -> bool:
        """Whether nothing speaks against it."""
        return not self.refusals
