"""What happens to offboard control, and what is to be done then."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto

from app.domain.offboard.control_method import ControlMethod
from app.domain.offboard.state import Lease, LeaseChange, OffboardState
from app.domain.reasons import Reason
from app.domain.vehicle.facts import LinkFact
from app.domain.vehicle.state import VehicleState


@dataclass(frozen=True, slots=True)
class Take:
    """Somebody wants this new lease, for a stream of `rate_hz`; a lease that begins is flown by `control_method`."""

    lease: Lease
    rate_hz: float
    control_method: ControlMethod
    override: bool


@dataclass(frozen=True, slots=True)
class Renew:
    """The holder uses its lease."""

    lease_id: str


@dataclass(frozen=True, slots=True)
class Offer:
    """The holder lets `to` take it over; None takes the offer back."""

    lease_id: str
    to: str | None


@dataclass(frozen=True, slots=True)
class End:
    """The lease ends. `holds`: a vehicle that follows us is told to; otherwise nothing is commanded."""

    change: LeaseChange
    reason: Reason
    holds: bool


@dataclass(frozen=True, slots=True)
class Enter:
    """The holder wants control, `by` these means; None: by the usual ones, which are None where there are none."""

    control_method: ControlMethod | None
    usual: ControlMethod | None


@dataclass(frozen=True, slots=True)
class Proceed:
    """The entry has come so far."""

    state: OffboardState
    reason: Reason | None = None


@dataclass(frozen=True, slots=True)
class EntryFailed:
    """The client keeps its lease, and the vehicle is in Hold."""

    reason: Reason


@dataclass(frozen=True, slots=True)
class Leave:
    """The mode `to` is about to be commanded."""

    to: str


@dataclass(frozen=True, slots=True)
class LeavingFailed:
    """It was not, or not seen: the vehicle may have left OFFBOARD all the same."""

    to: str


@dataclass(frozen=True, slots=True)
class Commanded:
    """A person commands something beside the lease; empty: it was refused."""

    action: str


@dataclass(frozen=True, slots=True)
class Heard:
    """A fact of the link."""

    fact: LinkFact


@dataclass(frozen=True, slots=True)
class HoldSaid:
    """The Hold after the end was answered; `unconfirmed`: why it is not sure, in words."""

    unconfirmed: str = ""


@dataclass(frozen=True, slots=True)
class Tick:
    """The time has gone on."""


@dataclass(frozen=True, slots=True)
class Due:
    """Whoever guides has spoken: what is to leave leaves now."""


OfLease = Take | Renew | Offer
OnTheWay = Enter | Proceed | EntryFailed | Leave | LeavingFailed
What = OfLease | OnTheWay | End | Commanded | Heard | HoldSaid | Tick | Due


@dataclass(frozen=True, slots=True)
class Input:
    """What happens, when (monotonic), and how the vehicle is then."""

    what: What
    now_s: float
    vehicle: VehicleState


class Do(Enum):
    """Effects without parameters."""

    CLEAR_SETPOINT = auto()
    COUNT_SILENCE = auto()
    STOP = auto()
    """No more ticks, setpoints and orders; what enters or leaves for this lease is broken off."""
    STOP_LEAVING = auto()
    SAY_HOLD = auto()
    UNSAY_HOLD = auto()
    SEND = auto()
    """The newest setpoint, or a velocity of zero; the end, if the client is gone."""
    ORDER = auto()
    """The command that is wanted and does not hold yet."""
    SHOW = auto()
    """Whoever shows it looks again."""


@dataclass(frozen=True, slots=True)
class Start:
    """Ticks begin, for a new lease."""

    rate_hz: float


@dataclass(frozen=True, slots=True)
class RecordLease:
    """Record what became of the lease. `other` held it before, or is the principal it is offered to."""

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


Effect = Do | Start | RecordLease | RecordState
