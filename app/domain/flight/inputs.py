"""What a flight is told, and what it answers. An input carries the vehicle as it is at that moment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from app.domain.commands import CommandAck
from app.domain.consent import Answer
from app.domain.events import AnyPayload
from app.domain.flight.orders import Order
from app.domain.flight.pending_change import PendingChange
from app.domain.moving_target.report import TargetFix
from app.domain.ports import LinkFact
from app.domain.rally import RallyDestination
from app.domain.reason import Reason
from app.domain.run import Asked, RunState
from app.domain.vehicle import VehicleState


@dataclass(frozen=True, slots=True)
class Sight:
    """The vehicle at `now_s` (our monotonic seconds) and `time_s` (Unix seconds), and the targets' newest fixes."""

    state: VehicleState
    now_s: float
    time_s: float
    targets: Mapping[str, TargetFix] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Looked:
    """It was looked at: at each fact, and every tenth of a second."""

    sight: Sight


@dataclass(frozen=True, slots=True)
class Told:
    """The link told a fact."""

    sight: Sight
    fact: LinkFact


@dataclass(frozen=True, slots=True)
class TakenUp:
    """After a restart of ours: what the run's record says was flown, and which item the vehicle shows."""

    sight: Sight
    flown: tuple[str, ...]
    current: int | None


@dataclass(frozen=True, slots=True)
class AskedFor:
    """A user asks for something instead of the mission; `rally` is where a return goes."""

    sight: Sight
    asked: Asked
    rally: RallyDestination | None = None


@dataclass(frozen=True, slots=True)
class DropFailed:
    """The plan's answer to a failed drop is about to be sent."""

    sight: Sight
    asked: Asked


@dataclass(frozen=True, slots=True)
class NotDone:
    """What was asked for was not done: `before` counts again, unless somebody asked for something else since."""

    sight: Sight
    asked: Asked
    before: Asked | None
    rally: RallyDestination | None = None


@dataclass(frozen=True, slots=True)
class Commanding:
    """The vehicle is being told this now; None: it has answered, or will not."""

    sight: Sight
    asked: Asked | None


@dataclass(frozen=True, slots=True)
class MovingOn:
    """A command that makes another item current is sent (1), or was answered (-1)."""

    sight: Sight
    count: int


@dataclass(frozen=True, slots=True)
class Diverting:
    """The vehicle is about to be sent to this drop's alternate."""

    sight: Sight
    plan_item_id: str


@dataclass(frozen=True, slots=True)
class ReleaseAnswered:
    """A COMMAND_ACK of one release of a drop; `leg` is the number of the run's changes when it was sent."""

    sight: Sight
    leg: int
    plan_item_id: str
    attempt: int
    ack: CommandAck


@dataclass(frozen=True, slots=True)
class ReleaseUnanswered:
    """No final ack of it came in time."""

    sight: Sight
    leg: int
    plan_item_id: str
    attempt: int


@dataclass(frozen=True, slots=True)
class ReleaseNotSent:
    """It was not sent after all."""

    sight: Sight
    leg: int
    plan_item_id: str
    attempt: int


@dataclass(frozen=True, slots=True)
class ConsentAnswered:
    """An operator answers a drop that asks."""

    sight: Sight
    plan_item_id: str
    answer: Answer
    by: str


@dataclass(frozen=True, slots=True)
class ChangeBegun:
    """A changed mission is about to be sent, or to be followed without being sent."""

    sight: Sight
    change: PendingChange


@dataclass(frozen=True, slots=True)
class ChangeWithdrawn:
    """It was not sent."""

    sight: Sight


@dataclass(frozen=True, slots=True)
class ChangeArrived:
    """Its transfer says that the vehicle carries it."""

    sight: Sight


@dataclass(frozen=True, slots=True)
class ChangeSent:
    """Its transfer is over, whatever came of it."""

    sight: Sight


@dataclass(frozen=True, slots=True)
class Ends:
    """The run ends now, for a reason outside the flight."""

    sight: Sight
    state: RunState
    reason: Reason | None


FlightInput = (
    Looked
    | Told
    | TakenUp
    | AskedFor
    | DropFailed
    | NotDone
    | Commanding
    | MovingOn
    | Diverting
    | ReleaseAnswered
    | ReleaseUnanswered
    | ReleaseNotSent
    | ConsentAnswered
    | ChangeBegun
    | ChangeWithdrawn
    | ChangeArrived
    | ChangeSent
    | Ends
)


@dataclass(frozen=True, slots=True)
class Record:
    """Store this event of the run."""

    payload: AnyPayload


FlightEffect = Record | Order
