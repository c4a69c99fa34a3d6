"""A job: a plan that is to be flown by one vehicle, or by any that can; and which state may follow which."""

from __future__ import annotations

from enum import StrEnum
from typing import Final, Literal

from pydantic import BaseModel, ConfigDict

from app.domain.errors import JobWrongStateError
from app.domain.jobs.candidate import Candidate
from app.domain.prediction.wind import Wind
from app.domain.reason import Reason
from app.domain.vehicle import VehicleType

ANY: Final = "any"
"""In the place of a vehicle's id: whichever can."""


class JobState(StrEnum):
    """The states of a job. `preparing`: a vehicle was chosen, and the mission goes to it; `prepared`: it is there."""

    QUEUED = "queued"
    PREPARING = "preparing"
    PREPARED = "prepared"
    FLYING = "flying"
    COMPLETED = "completed"
    FAILED = "failed"
    CANCELLED = "cancelled"
    EXPIRED = "expired"


_S = JobState
OVER: Final = frozenset({_S.COMPLETED, _S.FAILED, _S.CANCELLED, _S.EXPIRED})
NEXT: Final[dict[JobState, frozenset[JobState]]] = {
    _S.QUEUED: frozenset({_S.PREPARING, _S.CANCELLED, _S.EXPIRED}),
    # back to queued: the vehicle was taken meanwhile, or a restart broke the preparation off; nothing was started
    _S.PREPARING: frozenset({_S.QUEUED, _S.PREPARED, _S.FLYING, *OVER}),
    _S.PREPARED: frozenset({_S.FLYING, *OVER}),
    _S.FLYING: frozenset({_S.COMPLETED, _S.FAILED}),
    **{state: frozenset() for state in OVER},
}
EndAsked = Literal["", "cancelled", "expired"]


class Wish(BaseModel):
    """Which vehicles a job may have. `vehicle` is an id or "any"; then `allowed_vehicles` may narrow it.

    `min_battery_percent`: a vehicle with less is refused, and so is one that does not tell, unless it is 0.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    vehicle: str
    allowed_vehicles: tuple[str, ...] = ()
    min_battery_percent: float = 0.0

    @property
    def is_any(self) -> bool:
        """Whether we choose."""
        return self.vehicle == ANY

    @property
    def named(self) -> tuple[str, ...]:
        """The vehicles that are named; none: all of the fleet."""
        return self.allowed_vehicles if self.is_any else (self.vehicle,)

    def allows(self, vehicle_id: str) -> bool:
        """Whether this vehicle may have the job, if it can."""
        return not self.named or vehicle_id in self.named


class Job(BaseModel):
    """One job as stored and shown. Times are Unix seconds.

    `priority`: the higher goes first; `rank` orders those of one priority, the lower first. `deadline` is the latest
    start. `vehicle_id`, `run_id` and `candidates` are of the assignment; a queued job has none. `auto_start` false: the
    run waits on the vehicle for a person's start. `start_asked_at`: Waydrop told the run to start; it does so once.
    `wind` is what its checks and its run reckon with; null is calm air. `warning`, of one that waits: why waiting alone
    gives it to no vehicle; empty if it may. `end_asked`: the job is to end so as soon as its run has been taken off
    the vehicle.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    id: str
    plan_id: str
    plan_name: str
    vehicle_type: VehicleType
    order_id: str | None = None
    wish: Wish
    wind: Wind | None = None
    warning: str = ""
    not_before: float | None = None
    deadline: float | None = None
    auto_start: bool = False
    priority: int = 0
    rank: int = 0
    state: JobState = JobState.QUEUED
    reason: Reason | None = None
    requested_by: str = ""
    vehicle_id: str | None = None
    run_id: str | None = None
    candidates: tuple[Candidate, ...] = ()
    start_asked_at: float | None = None
    end_asked: EndAsked = ""
    created_at: float
    updated_at: float
    ended_at: float | None = None

    @property
    def is_over(self) -> bool:
        """Whether no further state can follow."""
        return self.state in OVER

    @property
    def is_active(self) -> bool:
        """Whether it has a vehicle now."""
        return self.state in (JobState.PREPARING, JobState.PREPARED, JobState.FLYING)

    @property
    def place(self) -> tuple[int, int]:
        """What jobs that wait are ordered by."""
        return -self.priority, self.rank

    def is_due(self, now: float) -> bool:
        """Whether it waits, and its time has come."""
        return self.state is JobState.QUEUED and (self.not_before is None or now >= self.not_before)

    def is_late(self, now: float) -> bool:
        """Whether its latest start is over."""
        return self.deadline is not None and now >= self.deadline

    def moved_to(self, state: JobState, *, now: float, reason: Reason | None = None, **changes: object) -> Job:
        """The job in its next state. Raises JobWrongStateError if that may not follow the present one."""
        if state not in NEXT[self.state]:
            raise JobWrongStateError(
                f"job {self.id} is {self.state.value}: it cannot become {state.value}",
                hint="read the job again",
                state=self.state.value,
            )
        ended = {"ended_at": now, "end_asked": ""} if state in OVER else {}
        return self.changed(now=now, state=state, reason=reason, **ended, **changes)

    def assigned(self, vehicle_id: str, run_id: str, candidates: tuple[Candidate, ...], *, now: float) -> Job:
        """With the vehicle that was chosen, and the id of the run that is made next."""
        why = next((one.reason for one in candidates if one.vehicle_id == vehicle_id), None)
        given = {"vehicle_id": vehicle_id, "run_id": run_id, "candidates": candidates}
        return self.moved_to(JobState.PREPARING, now=now, reason=why, **given)

    def requeued(self, reason: Reason | None, *, now: float) -> Job:
        """Without its vehicle again; its place is kept. One that was to end ends instead."""
        if self.end_asked:
            return self.moved_to(JobState(self.end_asked), now=now, reason=self.reason)
        gone = {"vehicle_id": None, "run_id": None, "candidates": (), "start_asked_at": None}
        return self.moved_to(JobState.QUEUED, now=now, reason=reason, **gone)

    def changed(self, *, now: float, **changes: object) -> Job:
        """With other fields changed."""
        return self.model_copy(update={**changes, "updated_at": now})
