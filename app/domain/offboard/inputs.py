"""The inputs and effects of offboard control."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto

from app.domain.offboard.control_method import ControlMethod
from app.domain.offboard.state import Lease, LeaseChange, OffboardState
from app.domain.reasons import Reason
from app.domain.vehicle.facts import LinkFact
from app.domain.vehicle.state import VehicleState


@dataclass(frozen=True, slots=True)
class AcquireLease:
    """A client requests this new lease, for a stream of `rate_hz`. `control_method` applies if the lease begins."""

    lease: Lease
    rate_hz: float
    control_method: ControlMethod
    override: bool


@dataclass(frozen=True, slots=True)
class RenewLease:
    """The holder used its lease."""

    lease_id: str


@dataclass(frozen=True, slots=True)
class OfferLease:
    """The holder offers the lease to `to`; None withdraws the offer."""

    lease_id: str
    to: str | None


@dataclass(frozen=True, slots=True)
class EndLease:
    """The lease ends. `holds`: a vehicle under offboard control is commanded to hold; otherwise nothing is
    commanded.
    """

    change: LeaseChange
    reason: Reason
    holds: bool


@dataclass(frozen=True, slots=True)
class Enter:
    """The holder enters offboard control by this method; None: by `usual`, which is None if there is none."""

    control_method: ControlMethod | None
    usual: ControlMethod | None


@dataclass(frozen=True, slots=True)
class EntryProgressed:
    """Progress of the entry."""

    state: OffboardState
    reason: Reason | None = None


@dataclass(frozen=True, slots=True)
class EntryFailed:
    """The entry failed. The client keeps its lease, and the vehicle is in Hold mode."""

    reason: Reason


@dataclass(frozen=True, slots=True)
class Leave:
    """The mode `to` will be commanded."""

    to: str


@dataclass(frozen=True, slots=True)
class LeavingFailed:
    """The mode was not commanded or not confirmed; the vehicle may have left OFFBOARD nevertheless."""

    to: str


@dataclass(frozen=True, slots=True)
class UserCommanded:
    """A user commands something without the lease; empty: the command was rejected."""

    action: str


@dataclass(frozen=True, slots=True)
class LinkFactReceived:
    """A fact from the link."""

    fact: LinkFact


@dataclass(frozen=True, slots=True)
class HoldAnswered:
    """The Hold command after the end of control was answered; `unconfirmed`: why it is uncertain."""

    unconfirmed: str = ""


@dataclass(frozen=True, slots=True)
class Tick:
    """Time has passed."""


@dataclass(frozen=True, slots=True)
class SetpointDue:
    """The source of setpoints has updated its output: send it now."""


LeaseInput = AcquireLease | RenewLease | OfferLease
TransitionInput = Enter | EntryProgressed | EntryFailed | Leave | LeavingFailed
AnyInput = (
    LeaseInput | TransitionInput | EndLease | UserCommanded | LinkFactReceived | HoldAnswered | Tick | SetpointDue
)


@dataclass(frozen=True, slots=True)
class Input:
    """The input, its time (monotonic), and the state of the vehicle then."""

    content: AnyInput
    now_s: float
    vehicle: VehicleState


class ControlAction(Enum):
    """Effects without parameters."""

    CLEAR_SETPOINT = auto()
    RESTART_DEAD_MAN = auto()
    STOP = auto()
    """No more ticks, setpoints and commands; entering or leaving for this lease is aborted."""
    STOP_ENTERING_OR_LEAVING = auto()
    COMMAND_HOLD = auto()
    CANCEL_HOLD = auto()
    SEND_SETPOINT = auto()
    """Send the newest setpoint or zero velocity; end the lease if the client is gone."""
    SEND_COMMAND = auto()
    """Send the pending command if it differs from the current one."""
    NOTIFY = auto()
    """Notify observers of the state."""


@dataclass(frozen=True, slots=True)
class StartStream:
    """Start ticks for a new lease."""

    rate_hz: float


@dataclass(frozen=True, slots=True)
class RecordLease:
    """Record a change of the lease. `other` is the previous holder, or the principal that it is offered to."""

    change: LeaseChange
    holder: str
    other: str | None = None
    reason: Reason | None = None


@dataclass(frozen=True, slots=True)
class RecordState:
    """Record the state that offboard control is in now."""

    state: OffboardState
    holder: str | None
    reason: Reason | None = None


Effect = ControlAction | StartStream | RecordLease | RecordState
