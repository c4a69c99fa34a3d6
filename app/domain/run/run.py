"""A run: one flight of one plan by one vehicle, and which state may follow which."""

from __future__ import annotations

from enum import StrEnum
from typing import Final

from app.domain.airspace.rally import RallyDestination
from app.domain.drop.record import DropOutcome, DropRecord
from app.domain.errors import WrongStateError
from app.domain.model import FrozenForm
from app.domain.prediction.motion import Wind
from app.domain.reasons import Reason
from app.domain.vehicle.link_security import LinkSecurity
from app.domain.vehicle.state import GlobalPosition, InFlight, VehicleType


class RunState(StrEnum):
    """The states of a run. `lost`: the vehicle is not seen any more and the outcome had to be closed without it."""

    CREATED = "created"
    UPLOADING = "uploading"
    UPLOADED = "uploaded"
    STARTING = "starting"
    FLYING = "flying"
    AT_DROP = "at_drop"
    PAUSED = "paused"
    RETURNING = "returning"
    LANDED = "landed"
    COMPLETED = "completed"
    ABORTED = "aborted"
    FAILED = "failed"
    LOST = "lost"


_S = RunState
TERMINAL: Final = frozenset({_S.COMPLETED, _S.ABORTED, _S.FAILED, _S.LOST})
NOT_STARTED: Final = frozenset({_S.CREATED, _S.UPLOADING, _S.UPLOADED})
"""No start is in progress: the run can be taken off the vehicle without moving it."""
BEFORE_FLIGHT: Final = NOT_STARTED | {_S.STARTING}
IN_FLIGHT: Final = frozenset({_S.FLYING, _S.AT_DROP, _S.PAUSED, _S.RETURNING})
_AIRBORNE_NEXT = frozenset({_S.FLYING, _S.AT_DROP, _S.PAUSED, _S.RETURNING, _S.LANDED, _S.ABORTED, _S.FAILED, _S.LOST})

NEXT: Final[dict[RunState, frozenset[RunState]]] = {
    _S.CREATED: frozenset({_S.UPLOADING, _S.ABORTED, _S.FAILED}),
    _S.UPLOADING: frozenset({_S.UPLOADED, _S.ABORTED, _S.FAILED, _S.LOST}),
    _S.UPLOADED: frozenset({_S.STARTING, _S.ABORTED, _S.FAILED, _S.LOST}),
    # back to uploaded: a start that fails on the ground disarms and may be tried again
    _S.STARTING: frozenset({_S.UPLOADED, _S.FLYING, _S.ABORTED, _S.FAILED, _S.LOST}),
    _S.FLYING: _AIRBORNE_NEXT | {_S.COMPLETED},
    _S.AT_DROP: _AIRBORNE_NEXT,
    _S.PAUSED: _AIRBORNE_NEXT,
    _S.RETURNING: _AIRBORNE_NEXT,
    _S.LANDED: frozenset({_S.COMPLETED, _S.ABORTED, _S.FAILED, _S.FLYING, _S.AT_DROP, _S.LOST}),
    _S.COMPLETED: frozenset(),
    _S.ABORTED: frozenset(),
    _S.FAILED: frozenset(),
    _S.LOST: frozenset(),
}


class RunAction(StrEnum):
    """What was last commanded of a run in flight instead of its mission, by a user or by its plan."""

    PAUSE = "pause"
    RESUME = "resume"
    """Until the vehicle is in Mission mode again."""
    RETURN = "return"
    LAND = "land"
    CONTINGENCY = "contingency"
    """A drop failed, and the plan requires a return."""
    CONTINGENCY_HOLD = "contingency_hold"
    """A drop failed, and the plan requires to hold."""
    REFUSED = "refused"
    """The vehicle holds, because it found a changed mission infeasible."""


HOLDS: Final = frozenset({RunAction.PAUSE, RunAction.CONTINGENCY_HOLD})
"""The vehicle was told to hold, by a user or by its plan."""


class PlanChange(FrozenForm):
    """A changed plan in flight: what is left of it from `continue_at` on, without the drops in `omitted`.

    `mission_hash`, `mission_id`: see Run, of the rest alone. `began` is where the vehicle was. Times are Unix seconds.
    """

    plan_id: str
    plan_hash: str
    mission_hash: str
    mission_id: int
    continue_at: str
    omitted: tuple[str, ...]
    began: InFlight
    actor: str
    at: float


class LastPosition(FrozenForm):
    """Where a vehicle was heard last, in degrees (GLOBAL_POSITION_INT), and when, in Unix seconds.

    `is_estimated`: it had no 3D GNSS fix then, and may be elsewhere.
    """

    latitude_deg: float
    longitude_deg: float
    at: float
    is_estimated: bool = False


class TakenOver(FrozenForm):
    """A run that another gateway of its site followed before: `number` counts, and the highest number is valid.

    `is_found`: the vehicle was found since. `at` is in Unix seconds.
    """

    gateway: str
    from_gateway: str
    number: int
    at: float
    is_found: bool = False


class Run(FrozenForm):
    """One run as stored and shown. Times are Unix seconds.

    `item_id` is the plan item that the vehicle flies to or does. `flown_item_ids` are the items passed, in order.
    `mission_id` is PX4's CRC32 of the uploaded items (MISSION_ACK.opaque_id), None where the firmware gives none;
    `mission_hash` is SHA-256 over mission, fence and rally points as they were compiled (mission.py).
    `commanded`: see RunAction; null for the mission itself.
    `rally` is the rally point to which it was commanded to return; null for any other return.
    `wind` is the one that its checks and its prediction reckon with.
    A plan may be changed in flight: `plan_id` to `mission_hash` are of the newest that the vehicle carries, `change`
    says where it went on, `changes` counts, and `flown_before_change` of `flown_item_ids` were flown before it.
    `changing` is a change whose arrival on board is not known yet.
    `continues` is the run whose rest this one flies, `continued_by` the one that flies the rest of this: at most one.
    `reached_seq` is the highest mission item known to be done: after a reboot of the vehicle nothing before it is
    flown again.
    `taken_over` is set once another gateway of the site has taken the run over.
    `link_security` is the weakest protection that the vehicle's link had during the run; null: not known.
    `compiled_home` is home (HOME_POSITION) with which its mission was compiled, and `home` as the vehicle took off: PX4
    moves it as it arms, and as it disarms; null: not known.
    `last_position` is the newest position of the vehicle that was known as the run ended; null before, and if none was.
    """

    id: str
    plan_id: str
    plan_hash: str
    vehicle_id: str
    vehicle_uid: str | None = None
    vehicle_type: VehicleType | None = None
    firmware: str | None = None
    link_security: LinkSecurity | None = None
    state: RunState = RunState.CREATED
    reason: Reason | None = None
    item_id: str | None = None
    flown_item_ids: tuple[str, ...] = ()
    reached_seq: int | None = None
    mission_id: int | None = None
    mission_hash: str | None = None
    upload_percent: float | None = None
    requested_by: str = ""
    start_requested: bool = False
    wind: Wind | None = None
    commanded: RunAction | None = None
    rally: RallyDestination | None = None
    change: PlanChange | None = None
    changing: PlanChange | None = None
    changes: int = 0
    flown_before_change: int = 0
    continues: str | None = None
    continued_by: str | None = None
    taken_over: TakenOver | None = None
    compiled_home: GlobalPosition | None = None
    home: GlobalPosition | None = None
    last_position: LastPosition | None = None
    drops: tuple[DropRecord, ...] = ()
    created_at: float
    updated_at: float
    started_at: float | None = None
    ended_at: float | None = None

    @property
    def is_over(self) -> bool:
        """Whether no further state can follow."""
        return self.state in TERMINAL

    @property
    def handovers(self) -> int:
        """How many times another gateway took the run over: what one with fewer says of it is not valid."""
        return 0 if self.taken_over is None else self.taken_over.number

    @property
    def is_new_here(self) -> bool:
        """Whether another gateway followed it until now: what that one did last may not have been told."""
        return self.taken_over is not None and not self.taken_over.is_found

    def moved_to(self, state: RunState, *, now: float, reason: Reason | None = None) -> Run:
        """The run in its next state.

        Raises:
            WrongStateError: if `state` may not follow the present one.
        """
        if state not in NEXT[self.state]:
            raise WrongStateError(
                f"run {self.id} is {self.state.value}: it cannot become {state.value}",
                hint="read the run again and see what it allows",
                state=self.state.value,
            )
        changes: dict[str, object] = {"state": state, "updated_at": now, "reason": reason}
        if state is RunState.FLYING and self.started_at is None:
            changes["started_at"] = now
        if state in TERMINAL:
            changes["ended_at"] = now
        return self.model_copy(update=changes)

    def with_drop(self, drop: DropRecord, *, now: float) -> Run:
        """The run with one drop's record replaced."""
        drops = tuple(drop if d.plan_item_id == drop.plan_item_id else d for d in self.drops)
        return self.model_copy(update={"drops": drops, "updated_at": now})

    @property
    def last_drops(self) -> tuple[DropRecord, ...]:
        """The drops that determine where each parcel is, without those whose parcel went on to an alternate.

        A parcel that came back from its alternate and was tried again is described by its drop alone.
        """
        kept = {drop.plan_item_id for drop in self.drops if drop.outcome is DropOutcome.KEPT}
        gone_on = {drop.alternate_to for drop in self.drops if drop.alternate_to in kept}
        tried_again = {drop.plan_item_id for drop in self.drops if drop.alternate_to not in (None, *kept)}
        return tuple([drop for drop in self.drops if drop.plan_item_id not in gone_on | tried_again])

    def drop(self, plan_item_id: str) -> DropRecord:
        """The record of one drop; KeyError if the plan has no such drop."""
        found = self.find_drop(plan_item_id)
        if found is None:
            raise KeyError(plan_item_id)
        return found

    def find_drop(self, plan_item_id: str) -> DropRecord | None:
        """The record of one drop; None if there is none, as of an alternate to which the vehicle was not sent."""
        return next((record for record in self.drops if record.plan_item_id == plan_item_id), None)
