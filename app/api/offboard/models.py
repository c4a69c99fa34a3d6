"""What requests and answers of offboard control look like."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.api.models import Identifier, RequestModel
from app.domain.autopilot.capability import AuditEntry, FirmwareProfile, FlightKind
from app.domain.errors import TaskRefusedError
from app.domain.offboard.control_method import Capability, task_means
from app.domain.offboard.limits import Clamp, OffboardLimits
from app.domain.offboard.setpoints import Setpoint
from app.services.offboard import FASTEST_HZ, SLOWEST_HZ
from app.services.offboard.preflight import PreflightReport
from app.services.views import FlownBy, OffboardView

RateHz = Annotated[float, Field(ge=SLOWEST_HZ, le=FASTEST_HZ, description="how often setpoints are sent")]
LeaseId = Annotated[str, Field(min_length=1, max_length=100, description="the id that taking the lease gave")]
Destination = Literal["hold", "mission", "return"]


class StrictRequest(RequestModel):
    """As JSON says it: no number for a string."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class LeaseRequest(StrictRequest):
    """Take the lease. `override` takes it from whoever has it, and needs the role admin."""

    rate_hz: RateHz | None = None
    override: bool = False


class LeaseUse(StrictRequest):
    """Something that only the holder of the lease may do."""

    lease: LeaseId


class HandOverRequest(LeaseUse):
    """Who may take the lease over; null takes the offer back."""

    to: Identifier | None


class EntryRequest(LeaseUse):
    """Enter OFFBOARD mode. `sticks_held`: a pilot holds the sticks, so a loss action that needs them is right.

    `flown_by` null: as the tasks of this vehicle are flown, so by `commands`, in Hold, where it follows none of their
    setpoints.
    """

    sticks_held: bool = False
    flown_by: FlownBy | None = None


class LeaveRequest(LeaseUse):
    """Leave OFFBOARD mode and give the lease back. `mission` goes on with the paused run."""

    to: Destination = "hold"


class SetpointRequest(LeaseUse):
    """One setpoint. It is sent from the next tick on, and no longer than 0.4 s."""

    setpoint: Setpoint


class LeaseGrant(BaseModel):
    """The lease. `lease` is its holder's secret; every use of it renews it for `expires_in_s`."""

    lease: str
    vehicle_id: str
    holder: str
    expires_in_s: float


class ClampView(BaseModel):
    """One thing that was changed of a setpoint."""

    code: str
    detail: str

    @classmethod
    def of(cls, clamp: Clamp) -> ClampView:
        """The view of a clamp."""
        return cls(code=clamp.code, detail=clamp.detail)


class SetpointAck(BaseModel):
    """The setpoint is in the slot, as it is or clamped."""

    clamped: list[ClampView]


class AuditView(BaseModel):
    """One audited parameter; `value` null: it did not answer."""

    parameter: str
    value: float | None
    blocks: bool
    meaning: str

    @classmethod
    def of(cls, entry: AuditEntry) -> AuditView:
        """The view of an entry."""
        return cls(parameter=entry.parameter, value=entry.value, blocks=entry.blocks, meaning=entry.meaning)


class EntryCheckQuery(BaseModel):
    """`sticks_held` as in the entry that is meant."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    sticks_held: bool = False


class EntryCheckView(BaseModel):
    """What an entry would find now. `reason` is empty unless the vehicle's state forbids it; an `audit` may too.

    `flown_by`: how its tasks would be flown; null: not at all. `run_id`: the run that must be paused first.
    """

    ready: bool
    reason: str
    hint: str
    audit: list[AuditView]
    flown_by: FlownBy | None = None
    run_id: str | None = None

    @classmethod
    def of(cls, outlook: PreflightReport) -> EntryCheckView:
        """The view of an outlook."""
        entries = [AuditView.of(entry) for entry in outlook.audit]
        means = None if outlook.flown_by is None else outlook.flown_by.value
        return cls(
            ready=outlook.ready,
            reason=outlook.reason,
            hint=outlook.hint,
            audit=entries,
            flown_by=means,
            run_id=outlook.run_id,
        )


class EntryView(BaseModel):
    """OFFBOARD mode is entered, or Hold if `offboard` says that it is flown by commands; the parameters on board."""

    audit: list[AuditView]
    offboard: OffboardView


class CapabilityView(BaseModel):
    """One setpoint form for this vehicle as it flies now. `frame` null: the message has none."""

    form: str
    taken: bool
    code: str
    reason: str
    message: str
    frame: str | None
    type_mask: int
    estimate: str

    @classmethod
    def of(cls, known: Capability) -> CapabilityView:
        """The view of a row of the capability table."""
        return cls(
            form=known.form,
            taken=known.verdict.is_taken,
            code=known.verdict.code,
            reason=known.verdict.reason,
            message=known.wire.message,
            frame=None if known.wire.frame is None else known.wire.frame.name,
            type_mask=known.wire.type_mask,
            estimate=known.wire.estimate.value,
        )


class TaskMeansView(BaseModel):
    """How tasks would be flown as the vehicle flies now. `flown_by` null: not at all, and `reason` says why."""

    flown_by: FlownBy | None
    reason: str = ""
    hint: str = ""

    @classmethod
    def of(cls, kind: FlightKind, profile: FirmwareProfile) -> TaskMeansView:
        """By the capability table."""
        try:
            return cls(flown_by=task_means(kind, profile).value)
        except TaskRefusedError as error:
            return cls(flown_by=None, reason=error.detail, hint=error.hint)


class OffboardDetail(BaseModel):
    """Offboard control of one vehicle: how it is, what the vehicle follows, how it flies tasks, what bounds it."""

    offboard: OffboardView
    capabilities: list[CapabilityView]
    tasks: TaskMeansView
    limits: OffboardLimits
