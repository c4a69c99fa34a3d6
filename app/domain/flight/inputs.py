"""The inputs and effects of a flight. Each input has the vehicle's state at that moment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from app.domain.airspace.rally import RallyDestination
from app.domain.drop.consent import Answer
from app.domain.events import AnyPayload
from app.domain.events.run import RunMissionChanged, RunUploadProgress
from app.domain.flight.progress import MissionProgress
from app.domain.flight.snapshot import DropCommand
from app.domain.mission import Mission
from app.domain.plan import Plan
from app.domain.prediction import Timeline
from app.domain.reasons import Reason
from app.domain.run.run import PlanChange, RunAction, RunState
from app.domain.targets import TargetFix
from app.domain.vehicle.commands import CommandAck
from app.domain.vehicle.facts import ClockRateSet, ItemReached, MissionCurrent, Rebooted, StatusText
from app.domain.vehicle.state import VehicleState

SETTLED_S: Final = 3.0
"""MISSION_CURRENT is sent at 1 Hz, and some may be lost."""


@dataclass(frozen=True, slots=True)
class PendingChange:
    """A changed mission that was sent to a vehicle in flight, until it is known whether it arrived.

    `mission` is the remainder of `plan`. `approach_speeds_m_s`: see MissionSegment. `follows`: it continues with the
    item that is being flown, not with a specified one. `is_same`: the same mission is already on board, so its ID is no
    evidence of the transfer. `is_open`: during the transfer, and until it is known which of the two missions the
    vehicle flies; no release is sent in this time. `ended_s`: when the transfer ended without a result (monotonic).
    """

    change: PlanChange
    plan: Plan
    mission: Mission
    timeline: Timeline
    follows: bool
    is_same: bool = False
    approach_speeds_m_s: Mapping[str, float] = field(default_factory=dict)
    is_open: bool = True
    ended_s: float | None = None

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

    def first_seq(self, flown_plan: Plan, progress: MissionProgress) -> int:
        """Return the item to continue with if the vehicle advanced in `flown_plan` during the transfer.

        0 if an earlier item is new: a change is never skipped, and flying back is harmless.
        """
        current = progress.item_id
        seqs = self.mission.seqs_of(current) if self.follows and current is not None else ()
        first = seqs[0] if seqs else 0
        before = {self.mission.plan_item_of[seq] for seq in range(first) if seq in self.mission.plan_item_of}
        flown = {item.id: item for item in flown_plan.items if item.id in progress.flown}
        as_flown = all(item == flown.get(item.id) for item in self.plan.items if item.id in before)
        return first if as_flown else 0


@dataclass(frozen=True, slots=True)
class Observation:
    """The vehicle at `now_s` (our monotonic seconds) and `time_s` (Unix seconds), and the targets' newest fixes."""

    state: VehicleState
    now_s: float
    time_s: float
    targets: Mapping[str, TargetFix] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Observed:
    """The vehicle was observed: after each fact, and every tenth of a second."""

    observed: Observation


FlightFact = ItemReached | MissionCurrent | Rebooted | ClockRateSet | StatusText
"""The facts that a flight uses. Everything else is in the vehicle's state."""


@dataclass(frozen=True, slots=True)
class FactReceived:
    """The link reported a fact."""

    observed: Observation
    fact: FlightFact


# Before the flight, and after a restart of the service.


@dataclass(frozen=True, slots=True)
class StateReached:
    """The preparation reached the next state of the run, or failed back to `uploaded`."""

    observed: Observation
    state: RunState
    reason: Reason | None = None


@dataclass(frozen=True, slots=True)
class UploadProgressed:
    """More items are on the vehicle."""

    observed: Observation
    progress: RunUploadProgress


@dataclass(frozen=True, slots=True)
class UploadVerified:
    """The vehicle carries the mission. `mission_id`: see Run."""

    observed: Observation
    mission_id: int | None
    reason: Reason


@dataclass(frozen=True, slots=True)
class Recovered:
    """The service restarted and found the vehicle again.

    `in_flight`: the run had been started. `flown` are the items that the run records as flown, `current` the item that
    the vehicle reports. `arrived`: a mission change is on board whose arrival was not observed.
    """

    observed: Observation
    in_flight: bool
    flown: tuple[str, ...] = ()
    current: int | None = None
    arrived: RunMissionChanged | None = None


# Commands of users, and of the plan when a drop failed.


@dataclass(frozen=True, slots=True)
class CommandRequested:
    """A user commands something instead of the mission; `rally` is where a return goes."""

    observed: Observation
    action: RunAction
    rally: RallyDestination | None = None


@dataclass(frozen=True, slots=True)
class ContingencyBegun:
    """The plan's answer to a failed drop is about to be sent."""

    observed: Observation
    action: RunAction


@dataclass(frozen=True, slots=True)
class CommandFailed:
    """The command was not carried out: `before` is restored, unless another command was given since."""

    observed: Observation
    action: RunAction
    before: RunAction | None
    rally: RallyDestination | None = None


@dataclass(frozen=True, slots=True)
class CommandPending:
    """The command that the vehicle is being sent; None: it has answered, or will not."""

    observed: Observation
    action: RunAction | None


@dataclass(frozen=True, slots=True)
class SetCurrentPending:
    """A command that makes another item current is sent (1), or was answered (-1)."""

    observed: Observation
    count: int


# Drops. `segment` is the number of the run's changes when the release was sent.


@dataclass(frozen=True, slots=True)
class DivertBegun:
    """The vehicle is about to be sent to this drop's alternate."""

    observed: Observation
    plan_item_id: str


@dataclass(frozen=True, slots=True)
class ReleaseAcknowledged:
    """A COMMAND_ACK of one release of a drop."""

    observed: Observation
    segment: int
    plan_item_id: str
    attempt: int
    ack: CommandAck


@dataclass(frozen=True, slots=True)
class ReleaseUnanswered:
    """No final COMMAND_ACK was received in time."""

    observed: Observation
    segment: int
    plan_item_id: str
    attempt: int


@dataclass(frozen=True, slots=True)
class ReleaseNotSent:
    """It was not sent."""

    observed: Observation
    segment: int
    plan_item_id: str
    attempt: int


@dataclass(frozen=True, slots=True)
class GripperUsed:
    """A task of offboard control is about to use the gripper."""

    observed: Observation


@dataclass(frozen=True, slots=True)
class ConsentAnswered:
    """An operator answers the consent request of a drop."""

    observed: Observation
    plan_item_id: str
    answer: Answer
    actor: str


@dataclass(frozen=True, slots=True)
class TargetNotFollowed:
    """The waypoint of this drop could not be moved after its target."""

    observed: Observation
    plan_item_id: str
    reason: Reason


# Changes of the mission in flight.


@dataclass(frozen=True, slots=True)
class ChangeBegun:
    """A changed mission is about to be sent, or to be followed without being sent."""

    observed: Observation
    change: PendingChange


@dataclass(frozen=True, slots=True)
class ChangeWithdrawn:
    """It was not sent."""

    observed: Observation


@dataclass(frozen=True, slots=True)
class ChangeArrived:
    """Its transfer succeeded: the vehicle carries it."""

    observed: Observation


@dataclass(frozen=True, slots=True)
class ChangeTransferEnded:
    """The transfer has ended, with any result."""

    observed: Observation


@dataclass(frozen=True, slots=True)
class ChangeRefused:
    """The vehicle received the change, found it infeasible, and holds; the previous mission is lost."""

    observed: Observation


@dataclass(frozen=True, slots=True)
class RunEnded:
    """The run ends now, for a reason outside the flight."""

    observed: Observation
    state: RunState
    reason: Reason | None


FlightInput = (
    Observed
    | FactReceived
    | StateReached
    | UploadProgressed
    | UploadVerified
    | Recovered
    | CommandRequested
    | ContingencyBegun
    | CommandFailed
    | CommandPending
    | SetCurrentPending
    | DivertBegun
    | ReleaseAcknowledged
    | ReleaseUnanswered
    | ReleaseNotSent
    | GripperUsed
    | ConsentAnswered
    | TargetNotFollowed
    | ChangeBegun
    | ChangeWithdrawn
    | ChangeArrived
    | ChangeTransferEnded
    | ChangeRefused
    | RunEnded
)


# Effects.


@dataclass(frozen=True, slots=True)
class RecordEvent:
    """Store this event of the run."""

    payload: AnyPayload


@dataclass(frozen=True, slots=True)
class MoveWaypoint:
    """Move the waypoint of a drop to where its target will be in `after_s`, by a change of the mission.

    `moved_m` is how far that is from where the waypoint was planned.
    """

    plan_item_id: str
    waypoint_id: str
    latitude_deg: float
    longitude_deg: float
    after_s: float
    moved_m: float
    fix: TargetFix


FlightCommand = DropCommand | MoveWaypoint
"""Commands to carry out, in this order."""
FlightEffect = RecordEvent | FlightCommand
