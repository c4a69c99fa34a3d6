"""Request and response models of offboard control."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from app.api.models import Identifier
from app.domain.autopilot.capability import AuditedParameter, FirmwareProfile, FlightKind
from app.domain.errors import TaskRefusedError
from app.domain.model import FrozenForm, StrictForm
from app.domain.offboard.control_method import Capability, task_control_method
from app.domain.offboard.limits import Clamp, OffboardLimits
from app.domain.offboard.setpoints import Setpoint
from app.services.offboard import FASTEST_HZ, SLOWEST_HZ
from app.services.offboard.preflight import PreflightReport
from app.services.views import ControlMethodName, OffboardView

RateHz = Annotated[float, Field(ge=SLOWEST_HZ, le=FASTEST_HZ, description="rate at which setpoints are sent")]
LeaseId = Annotated[
    str, Field(min_length=1, max_length=100, description="ID of the lease, returned when the lease was acquired")
]
Destination = Literal["hold", "mission", "return"]


class LeaseRequest(StrictForm):
    """Acquire the lease. `override` takes it from its holder and requires the role admin."""

    rate_hz: RateHz | None = None
    override: bool = False


class LeaseUse(StrictForm):
    """A request that requires the lease."""

    lease: LeaseId


class HandOverRequest(LeaseUse):
    """The principal that may take over the lease; null withdraws the offer."""

    to: Identifier | None


class EntryRequest(LeaseUse):
    """Enter OFFBOARD mode. `sticks_held`: a pilot holds the sticks, so a loss action that requires them is acceptable.

    `control_method` null: the method used for the vehicle's tasks. That is `commands`, in Hold mode, for a vehicle that
    cannot follow their setpoints.
    """

    sticks_held: bool = False
    control_method: ControlMethodName | None = None


class LeaveRequest(LeaseUse):
    """Leave OFFBOARD mode and release the lease. `mission` resumes the paused run."""

    to: Destination = "hold"


class SetpointRequest(LeaseUse):
    """A setpoint. The service sends it from the next tick on, for at most 0.4 s."""

    setpoint: Setpoint


class LeaseGrant(BaseModel):
    """The lease. `lease` is a secret of the holder. Every use renews it for `expires_in_s`."""

    lease: str
    vehicle_id: str
    holder: str
    expires_in_s: float


class ClampView(BaseModel):
    """A value of a setpoint that was clamped."""

    code: str
    detail: str

    @classmethod
    def of(cls, clamp: Clamp) -> ClampView:
        """Convert from the domain."""
        return cls(code=clamp.code, detail=clamp.detail)


class SetpointAck(BaseModel):
    """The setpoint was accepted, possibly clamped."""

    clamped: list[ClampView]


class AuditView(BaseModel):
    """An audited parameter. `value` is null if the vehicle did not answer.

    `blocks`: it prevents control. `doubtful`: it does not, but the vehicle reacts late to a failure, or not at all.
    """

    parameter: str
    value: float | None
    blocks: bool
    meaning: str
    doubtful: bool = False

    @classmethod
    def of(cls, entry: AuditedParameter) -> AuditView:
        """Convert from the domain."""
        return cls.model_validate(entry, from_attributes=True)


class EntryCheckQuery(FrozenForm):
    """`sticks_held` as in the request to enter."""

    sticks_held: bool = False


class EntryCheckView(BaseModel):
    """Result of an entry check. `reason` is empty unless the vehicle's state prevents the entry; `audit` may prevent it
    too.

    `control_method`: how the vehicle's tasks would be flown, null if they cannot be. `run_id`: a run to pause first.
    """

    ready: bool
    reason: str
    hint: str
    audit: list[AuditView]
    control_method: ControlMethodName | None = None
    run_id: str | None = None

    @classmethod
    def of(cls, report: PreflightReport) -> EntryCheckView:
        """Convert from the service."""
        entries = [AuditView.of(entry) for entry in report.audit]
        means = None if report.control_method is None else report.control_method.value
        return cls(
            ready=report.ready,
            reason=report.reason,
            hint=report.hint,
            audit=entries,
            control_method=means,
            run_id=report.run_id,
        )


class EntryView(BaseModel):
    """OFFBOARD mode was entered, or Hold mode for control by commands. Lists the audited parameters."""

    audit: list[AuditView]
    offboard: OffboardView


class CapabilityView(BaseModel):
    """A setpoint form that the vehicle follows in its current state. `frame` is null if the message has none."""

    form: str
    accepted: bool
    code: str
    reason: str
    message: str
    frame: str | None
    type_mask: int
    estimate: str

    @classmethod
    def of(cls, known: Capability) -> CapabilityView:
        """Convert from the capability table."""
        return cls(
            form=known.form,
            accepted=known.support.is_accepted,
            code=known.support.code,
            reason=known.support.reason,
            message=known.wire.message,
            frame=None if known.wire.frame is None else known.wire.frame.name,
            type_mask=known.wire.type_mask,
            estimate=known.wire.estimate.value,
        )


class TaskControlView(BaseModel):
    """How tasks would be flown in the current state. `control_method` null: not possible, for the given `reason`."""

    control_method: ControlMethodName | None
    reason: str = ""
    hint: str = ""

    @classmethod
    def of(cls, kind: FlightKind, profile: FirmwareProfile) -> TaskControlView:
        """Convert from the capability table."""
        try:
            return cls(control_method=task_control_method(kind, profile).value)
        except TaskRefusedError as error:
            return cls(control_method=None, reason=error.detail, hint=error.hint)


class OffboardDetail(BaseModel):
    """Offboard control of a vehicle: state, accepted setpoints, task support and limits."""

    offboard: OffboardView
    capabilities: list[CapabilityView]
    tasks: TaskControlView
    limits: OffboardLimits
