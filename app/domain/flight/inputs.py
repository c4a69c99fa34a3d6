"""What a flight is told, and what it answers. An input carries the vehicle as it is at that moment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from app.domain.airspace.rally import RallyDestination
from app.domain.drop.consent import Answer
from app.domain.events import AnyPayload
from app.domain.flight.look import Order
from app.domain.flight.progress import MissionProgress
from app.domain.mission import Mission
from app.domain.plan import Plan
from app.domain.prediction import Timeline
from app.domain.reasons import Reason
from app.domain.run.run import Asked, PlanChange, RunState
from app.domain.targets import TargetFix
from app.domain.vehicle.commands import CommandAck
from app.domain.vehicle.facts import ClockRateTold, ItemReached, MissionCurrent, Rebooted
from app.domain.vehicle.state import VehicleState

# A changed mission that was sent to a vehicle in flight, until it is known whether it arrived.


SETTLED_S: Final = 3.0
"""MISSION_CURRENT comes at 1 Hz, and some may be lost."""


@dataclass(frozen=True, slots=True)
class PendingChange:
    """`mission` is the rest of `plan`.

    `is_open` while it is under way, and until it is known which of the two the vehicle flies: no release is sent then.
    """

    change: PlanChange
    plan: Plan
    mission: Mission
    timeline: Timeline
    follows: bool
    """It goes on with whatever item is flown, and not with one that was named."""

    is_same: bool = False
    """The vehicle carries this very mission already: that it names it says nothing of the transfer."""

    is_open: bool = True
    ended_s: float | None = None
    """When its transfer ended without a word whether it arrived; monotonic."""

    def is_missing(self, state: VehicleState, since_s: float, now_s: float) -> bool:
        """Whether the vehicle has gone on naming another mission, heard since then and after the transfer.

        The very same mission is missing too, unless its transfer said that it arrived: it is flown on as before.
        """
        if self.ended_s is None or not state.mission_id:
            return False
        return self.is_open and now_s - max(self.ended_s, since_s) > SETTLED_S

    def has_arrived(self, state: VehicleState) -> bool:
        """Whether the vehicle names it as the mission that it carries (MISSION_CURRENT.mission_id)."""
        return state.mission_id == self.change.mission_id and not self.is_same

    def first_seq(self, flown_by: Plan, progress: MissionProgress) -> int:
        """Its item to go on with, if the vehicle has come further in `flown_by` while it was under way.

        0 if anything before that is news: what a change brings is never skipped, and flying back does no harm.
        """
        current = progress.item_id
        seqs = self.mission.seqs_of(current) if self.follows and current is not None else ()
        first = seqs[0] if seqs else 0
        before = {self.mission.plan_item_of[seq] for seq in range(first) if seq in self.mission.plan_item_of}
        flown = {item.id: item for item in flown_by.items if item.id in progress.flown}
        as_flown = all(item == flown.get(item.id) for item in self.plan.items if item.id in before)
        return first if as_flown else 0


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


FlightFact = ItemReached | MissionCurrent | Rebooted | ClockRateTold
"""What a flight makes something of. All else is in the vehicle's state."""


@dataclass(frozen=True, slots=True)
class Told:
    """The link told a fact."""

    sight: Sight
    fact: FlightFact


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
    actor: str


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
