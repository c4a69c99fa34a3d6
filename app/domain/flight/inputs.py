"""The inputs and effects of a flight. An input carries the vehicle's state at that moment."""

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

# A changed mission that was sent in flight, until it is known whether it arrived.


SETTLED_S: Final = 3.0
"""MISSION_CURRENT is sent at 1 Hz, and some may be lost."""


@dataclass(frozen=True, slots=True)
class PendingChange:
    """`mission` is the remaining mission of `plan`.

    `is_open` while it is in transfer, and until it is known which of the two the vehicle flies. No release is sent
    then.
    """

    change: PlanChange
    plan: Plan
    mission: Mission
    timeline: Timeline
    follows: bool
    """It continues with the current item, not with a named one."""

    is_same: bool = False
    """The vehicle already carries this mission, so its mission ID does not prove the transfer."""

    is_open: bool = True
    ended_s: float | None = None
    """When its transfer ended without a known result; monotonic."""

    def is_missing(self, state: VehicleState, since_s: float, now_s: float) -> bool:
        """Whether the vehicle has reported another mission since the transfer ended.

        An identical mission also counts as missing, unless its transfer succeeded: the flight continues as before.
        """
        if self.ended_s is None or not state.mission_id:
            return False
        return self.is_open and now_s - max(self.ended_s, since_s) > SETTLED_S

    def has_arrived(self, state: VehicleState) -> bool:
        """Whether the vehicle reports it as its mission (MISSION_CURRENT.mission_id)."""
        return state.mission_id == self.change.mission_id and not self.is_same

    def first_seq(self, flown_by: Plan, progress: MissionProgress) -> int:
        """Return the item to continue with if the vehicle advanced in `flown_by` during the transfer.

        0 if an earlier item is new: a change is never skipped, and flying back is harmless.
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
    """The vehicle at `now_s` (monotonic seconds) and `time_s` (Unix seconds), and the newest fixes of the targets."""

    state: VehicleState
    now_s: float
    time_s: float
    targets: Mapping[str, TargetFix] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Looked:
    """An observation: at each update, and every tenth of a second."""

    sight: Sight


FlightFact = ItemReached | MissionCurrent | Rebooted | ClockRateTold
"""The messages that a flight handles. Everything else is in the vehicle's state."""


@dataclass(frozen=True, slots=True)
class Told:
    """A message from the link."""

    sight: Sight
    fact: FlightFact


@dataclass(frozen=True, slots=True)
class TakenUp:
    """After a restart: what the run's record says was flown, and the current item of the vehicle."""

    sight: Sight
    flown: tuple[str, ...]
    current: int | None


@dataclass(frozen=True, slots=True)
class AskedFor:
    """A user requests something else than the mission; `rally` is the destination of a return."""

    sight: Sight
    asked: Asked
    rally: RallyDestination | None = None


@dataclass(frozen=True, slots=True)
class DropFailed:
    """What the plan specifies for a failed drop is about to be sent."""

    sight: Sight
    asked: Asked


@dataclass(frozen=True, slots=True)
class NotDone:
    """A request failed. `before` applies again, unless another request was made since."""

    sight: Sight
    asked: Asked
    before: Asked | None
    rally: RallyDestination | None = None


@dataclass(frozen=True, slots=True)
class Commanding:
    """The pending command of the vehicle; None after it was answered or given up."""

    sight: Sight
    asked: Asked | None


@dataclass(frozen=True, slots=True)
class MovingOn:
    """A command that changes the current item is sent (1), or was answered (-1)."""

    sight: Sight
    count: int


@dataclass(frozen=True, slots=True)
class Diverting:
    """The vehicle is about to be sent to this drop's alternate."""

    sight: Sight
    plan_item_id: str


@dataclass(frozen=True, slots=True)
class ReleaseAnswered:
    """A COMMAND_ACK of a release; `leg` is the number of mission changes when it was sent."""

    sight: Sight
    leg: int
    plan_item_id: str
    attempt: int
    ack: CommandAck


@dataclass(frozen=True, slots=True)
class ReleaseUnanswered:
    """No final acknowledgement arrived in time."""

    sight: Sight
    leg: int
    plan_item_id: str
    attempt: int


@dataclass(frozen=True, slots=True)
class ReleaseNotSent:
    """It was not sent."""

    sight: Sight
    leg: int
    plan_item_id: str
    attempt: int


@dataclass(frozen=True, slots=True)
class ConsentAnswered:
    """An operator answers the consent request of a drop."""

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
    """Its transfer succeeded: the vehicle carries it."""

    sight: Sight


@dataclass(frozen=True, slots=True)
class ChangeSent:
    """Its transfer ended, with any result."""

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
