"""The views of jobs and of the queues of vehicles, and the requests that change them."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Annotated, Any, Final, Self

from pydantic import AfterValidator, AwareDatetime, Field, model_validator
from pydantic_core import PydanticCustomError

from app.domain.jobs.job import ANY, Candidate, Job, Refusal, VehicleSelector
from app.domain.jobs.queue import MAX_WAITING, QueuePosition, VehicleQueue
from app.domain.model import Frozen, FrozenForm
from app.domain.prediction import WindGiven


@dataclass(frozen=True, slots=True, kw_only=True)
class JobSettings:
    """`poll_every_s`: the interval of polls, besides changes.

    `retry_after_s`: a job that no vehicle could take, or whose vehicle failed, is not retried sooner. `facts_s`: the
    time limit for a vehicle to report its parameters for the first time; reading continues meanwhile. `late_for_s`: see
    Deadlines.
    """

    capacity: int = MAX_WAITING
    poll_every_s: float = 0.5
    retry_after_s: float = 3.0
    facts_s: float = 5.0
    late_for_s: float = 5.0


LEAST_BATTERY_PERCENT: Final = 30.0
MAX_ALLOWED: Final = 100
_Identifier = Annotated[str, Field(min_length=1, max_length=100)]
_Priority = Annotated[int, Field(ge=-100, le=100)]
LONGEST_AHEAD: Final = timedelta(days=3653)
"""A later time is a mistake, and one near the end of the calendar cannot be shown in every time zone."""


def _not_too_late(time: datetime) -> datetime:
    if time - datetime.now(UTC) > LONGEST_AHEAD:
        hint = "give a time at most ten years ahead, or omit it"
        raise PydanticCustomError("too_late", "the time is more than ten years ahead", {"hint": hint})
    return time


_Time = Annotated[AwareDatetime, AfterValidator(_not_too_late)]


class JobRequest(FrozenForm):
    """A plan, by its id or the document itself, and the vehicles that may fly it: an id, or "any".

    `allowed_vehicles` restricts "any". A vehicle with less than `min_battery_percent`, or one that does not report its
    charge, is refused; 0 accepts both. `wind` is used by the checks and the run; null is calm air. The job does not
    start before `not_before`, and expires if the vehicle was not told to arm by `deadline`. `auto_start` false: the
    mission is uploaded, and an operator starts the run. True: Waydrop starts it, once, as soon as it is prepared and
    its vehicle has no refusals. Higher `priority` comes first. Both times are at most ten years ahead.
    """

    plan: _Identifier | dict[str, Any]
    vehicle: _Identifier = ANY
    allowed_vehicles: Annotated[tuple[_Identifier, ...], Field(max_length=MAX_ALLOWED)] = ()
    min_battery_percent: Annotated[float, Field(ge=0, le=100)] = LEAST_BATTERY_PERCENT
    wind: WindGiven | None = None
    not_before: _Time | None = None
    deadline: _Time | None = None
    auto_start: bool = False
    priority: _Priority = 0

    @model_validator(mode="after")
    def _narrows_any(self) -> Self:
        if self.allowed_vehicles and self.vehicle != ANY:
            raise PydanticCustomError("allowed_without_any", 'allowed_vehicles requires "vehicle": "any"')
        return self

    def selector(self) -> VehicleSelector:
        return VehicleSelector(
            vehicle=self.vehicle,
            allowed_vehicles=tuple(dict.fromkeys(self.allowed_vehicles)),
            min_battery_percent=self.min_battery_percent,
        )


class JobUpdate(FrozenForm):
    """Another priority, the first or last place among the waiting jobs of its priority, or a place before another job.

    With another priority and no `place` it goes behind those that have this priority already.
    `before` is a waiting job: the moved one takes its priority, too, so it goes without `priority` and `place`.
    """

    priority: _Priority | None = None
    place: QueuePosition | None = None
    before: _Identifier | None = None

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if self.before is not None and (self.priority is not None or self.place is not None):
            raise PydanticCustomError("before_alone", "before goes without priority and place")
        return self


class AssignmentView(Frozen):
    """Which vehicle would get a job now, null if none can, and what speaks for and against each.

    `warning`: why waiting alone gives it no vehicle; empty if it may.
    """

    vehicle_id: str | None
    candidates: tuple[Candidate, ...]
    warning: str = ""


class VehicleQueueView(Frozen):
    """One vehicle's queue. `ready`: a job could begin now, else `refusals` says why not.

    `job_id` is its current job, `waiting` are the jobs that it may get, in order.
    """

    queue: VehicleQueue
    ready: bool
    refusals: tuple[Refusal, ...]
    job_id: str | None
    waiting: tuple[str, ...]


class JobQueuesView(Frozen):
    """All jobs that wait, the next one first, and each vehicle. `dispatching` false: a defect of ours, see the log."""

    dispatching: bool
    capacity: int
    waiting: tuple[Job, ...]
    vehicles: tuple[VehicleQueueView, ...]
