"""A job: a plan that is to be flown by one vehicle, or by any that can; and which state may follow which."""

from __future__ import annotations

from enum import StrEnum
from typing import Final, Literal

from app.domain.drop.record import DropOutcome
from app.domain.errors import JobWrongStateError
from app.domain.model import FrozenForm
from app.domain.prediction.motion import Wind
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import BEFORE_FLIGHT, Run, RunState
from app.domain.vehicle.state import VehicleType

MOST_REFUSALS: Final = 20


class VehicleRefusal(StrEnum):
    """Stable codes of what prevents a vehicle from flying now. Codes of rules describe why it cannot fly the plan."""

    UNKNOWN = "vehicle.unknown"
    """The vehicle has not connected since Waydrop started."""
    NOT_ALLOWED = "vehicle.not_allowed"
    """The job names other vehicles."""
    SITE_NOT_HELD = "vehicle.site_not_held"
    """Another gateway has the site of its gateway."""
    QUARANTINED = "vehicle.quarantined"
    """Two vehicles answer to its system id."""
    DISCONNECTED = "vehicle.disconnected"
    """Its link is lost."""
    SILENT = "vehicle.silent"
    """It does not report its type or its parameters."""
    BUSY = "vehicle.busy"
    """It has a run, or another job."""
    LEASED = "vehicle.leased"
    """A client has its offboard lease."""
    ARMED = "vehicle.armed"
    """It is armed, or does not report it."""
    NOT_LANDED = "vehicle.not_landed"
    """It is not on the ground, or does not report it."""
    IN_FAILSAFE = "vehicle.in_failsafe"
    """It acts on a failsafe."""
    QUEUE_STOPPED = "vehicle.queue_stopped"
    """Its queue is stopped until an operator resumes it."""
    UNSIGNED = "vehicle.unsigned"
    """Its messages are not signed, those of other vehicles are, and the job names no vehicle."""
    BATTERY_LOW = "vehicle.battery_low"
    """Its battery charge is below the minimum of the job."""
    BATTERY_UNKNOWN = "vehicle.battery_unknown"
    """It does not report its battery, and the job requires a minimum."""


class Refusal(FrozenForm):
    """One reason. `code` is a VehicleRefusal or a rule's; `pointer` leads into the plan, null if it is not about it.
    `reason` is why the vehicle's queue is stopped, if it is.

    `permanent`: waiting, a full battery or a flight to the start of the plan do not resolve it.
    """

    code: str
    message: str
    reason: Reason | None = None
    hint: str = ""
    pointer: str | None = None
    permanent: bool = False


class Candidate(FrozenForm):
    """One vehicle. It can have the job if `refusals` is empty. `reason` says why it was chosen, or why another was.

    `distance_m`: from its position to the start of the plan, null if either is unknown. At most MOST_REFUSALS are
    listed; `omitted_refusals` counts the others. `permanent`: at least one of all refusals is permanent, so waiting
    alone does not make it suitable.
    """

    vehicle_id: str
    chosen: bool = False
    reason: Reason | None = None
    distance_m: float | None = None
    battery_percent: float | None = None
    refusals: tuple[Refusal, ...] = ()
    omitted_refusals: int = 0
    permanent: bool = False

    @property
    def can(self) -> bool:
        """Whether it has no refusals."""
        return not self.refusals


ANY: Final = "any"
"""In the place of a vehicle's id: whichever can."""


class JobState(StrEnum):
    """The states of a job. `preparing`: a vehicle was chosen, and the mission goes to it; `prepared`: it is there.
    `returned`: a gateway gave it back to its cluster, which queues it again.
    """

    QUEUED = "queued"
    PREPARING = "preparing"
    PREPARED = "prepared"
    FLYING = "flying"
    COMPLETED = "completed"
    FAILED = "failed"
    CANCELLED = "cancelled"
    EXPIRED = "expired"
    RETURNED = "returned"


TAKEN_WITHIN_S: Final = 15.0
"""A gateway takes no job that was given to it longer ago: the order was late, and its claim may have been cleared."""
_S = JobState
_ENDS: Final = frozenset({_S.COMPLETED, _S.FAILED, _S.CANCELLED, _S.EXPIRED})
OVER: Final = _ENDS | {_S.RETURNED}
"""For the journal that says so. The cluster goes on with one that was returned."""
NEXT: Final[dict[JobState, frozenset[JobState]]] = {
    _S.QUEUED: frozenset({_S.PREPARING, _S.CANCELLED, _S.EXPIRED}),
    # back to queued: the vehicle was taken meanwhile, or a restart broke the preparation off; nothing was started
    _S.PREPARING: frozenset({_S.QUEUED, _S.RETURNED, _S.PREPARED, _S.FLYING, *_ENDS}),
    _S.PREPARED: frozenset({_S.FLYING, *_ENDS}),
    _S.FLYING: frozenset({_S.COMPLETED, _S.FAILED}),
    **{state: frozenset() for state in OVER},
}
"""Of one journal; see also Job.taken_back."""
EndRequest = Literal["", "cancelled", "expired"]


class VehicleSelector(FrozenForm):
    """Which vehicles a job may have. `vehicle` is an id or "any"; then `allowed_vehicles` may narrow it.

    `min_battery_percent`: a vehicle with less is refused, and so is one that does not report it, unless it is 0.
    """

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


class JobClaim(FrozenForm):
    """The gateway that a cluster has given a job to; `taken` once that gateway has stored it."""

    site: str
    gateway: str
    taken: bool = False


class Job(FrozenForm):
    """One job as stored and shown. Times are Unix seconds.

    `priority`: higher comes first; `rank` orders jobs of the same priority, lower first. `deadline` is the latest
    start. `vehicle_id`, `run_id` and `candidates` belong to the assignment; a queued job has none. `auto_start` false:
    an operator starts the run. `start_requested_at`: when Waydrop requested the start, which it does once. `wind` is
    used by the checks and the run; null is calm air. `warning` of a waiting job: why waiting alone gives it no vehicle;
    empty if it may. `end_requested`: the job ends this way as soon as its run has been taken off the vehicle.

    `claim`: which gateway has a job that several sites may fly. `fence` is the fencing number of such a job: the
    cluster raises it with each change of its own, and what is stored with a lower one does not count. 0: the job
    belongs to one gateway.
    """

    id: str
    plan_id: str
    plan_hash: str
    plan_name: str
    vehicle_type: VehicleType
    order_id: str | None = None
    selector: VehicleSelector
    wind: Wind | None = None
    warning: str = ""
    not_before: float | None = None
    deadline: float | None = None
    auto_start: bool = False
    priority: int = 0
    rank: float = 0
    state: JobState = JobState.QUEUED
    reason: Reason | None = None
    requested_by: str = ""
    vehicle_id: str | None = None
    run_id: str | None = None
    candidates: tuple[Candidate, ...] = ()
    start_requested_at: float | None = None
    end_requested: EndRequest = ""
    fence: int = 0
    claim: JobClaim | None = None
    created_at: float
    updated_at: float
    ended_at: float | None = None

    @property
    def is_over(self) -> bool:
        """Whether no further state can follow."""
        return self.state in OVER

    @property
    def was_never_begun(self) -> bool:
        """Whether it ended, and no vehicle flew it."""
        return self.state in (JobState.RETURNED, JobState.CANCELLED, JobState.EXPIRED)

    @property
    def is_active(self) -> bool:
        """Whether it has a vehicle now."""
        return self.state in (JobState.PREPARING, JobState.PREPARED, JobState.FLYING)

    @property
    def place(self) -> tuple[int, float]:
        """What jobs that wait are ordered by."""
        return -self.priority, self.rank

    def is_due(self, now: float) -> bool:
        """Whether it waits and may start now."""
        return self.state is JobState.QUEUED and (self.not_before is None or now >= self.not_before)

    def is_late(self, now: float) -> bool:
        """Whether its deadline has passed."""
        return self.deadline is not None and now >= self.deadline

    def moved_to(self, state: JobState, *, now: float, reason: Reason | None = None, **changes: object) -> Job:
        """The job in its next state. Raises JobWrongStateError if that may not follow the present one."""
        if state not in NEXT[self.state]:
            raise JobWrongStateError(
                f"job {self.id} is {self.state.value}: it cannot become {state.value}",
                hint="read the job again",
                state=self.state.value,
            )
        ended = {"ended_at": now, "end_requested": ""} if state in OVER else {}
        return self.changed(now=now, state=state, reason=reason, **ended, **changes)

    def assigned(self, vehicle_id: str, run_id: str, candidates: tuple[Candidate, ...], *, now: float) -> Job:
        """With the vehicle that was chosen, and the id of the run that is made next."""
        why = next((one.reason for one in candidates if one.vehicle_id == vehicle_id), None)
        given = {"vehicle_id": vehicle_id, "run_id": run_id, "candidates": candidates}
        return self.moved_to(JobState.PREPARING, now=now, reason=why, **given)

    def requeued(self, reason: Reason | None, *, now: float) -> Job:
        """Without its vehicle again; its place is kept. One that was to end ends instead.

        A gateway gives a job of the cluster back: other sites may have a vehicle for it.
        """
        if self.end_requested:
            return self.moved_to(JobState(self.end_requested), now=now, reason=self.reason)
        if self.claim is not None:
            return self.moved_to(JobState.RETURNED, now=now, reason=reason)
        gone = {"vehicle_id": None, "run_id": None, "candidates": (), "start_requested_at": None}
        return self.moved_to(JobState.QUEUED, now=now, reason=reason, **gone)

    def given(self, claim: JobClaim, run_id: str, candidates: tuple[Candidate, ...], *, now: float) -> Job:
        """The cluster's job for the gateway of the chosen candidate."""
        vehicle_id = next(one.vehicle_id for one in candidates if one.chosen)
        return self.assigned(vehicle_id, run_id, candidates, now=now).changed(now=now, claim=claim)

    def taken_back(self, reason: Reason | None, *, now: float) -> Job:
        """The cluster's job without a gateway; one that was to end ends.

        Raises JobWrongStateError: its run was started, or it has ended.
        """
        if self.claim is None or self.state not in (JobState.PREPARING, JobState.PREPARED, JobState.RETURNED):
            raise JobWrongStateError(
                f"job {self.id} is {self.state.value} and cannot be given to another gateway",
                hint="read the job again",
                state=self.state.value,
            )
        given = self.model_copy(update={"state": JobState.PREPARING, "claim": None, "ended_at": None})
        return given.requeued(reason, now=now)

    def supersedes(self, known: Job) -> bool:
        """Whether this, which was told later, counts: of one fencing number, only its claimant says more."""
        claimants = [None if one.claim is None else one.claim.gateway for one in (self, known)]
        return self.fence > known.fence or (self.fence == known.fence and claimants[0] == claimants[1])

    def changed(self, *, now: float, **changes: object) -> Job:
        return self.model_copy(update={**changes, "updated_at": now})


JobChangeWord = Literal[
    "queued",
    "placed",
    "assigned",
    "requeued",
    "taken",
    "returned",
    "prepared",
    "start_asked",
    "started",
    "end_requested",
    "noted",
    "ended",
]
_BY_STATE: Final[dict[JobState, JobChangeWord]] = {
    JobState.QUEUED: "requeued",
    JobState.PREPARING: "assigned",
    JobState.PREPARED: "prepared",
    JobState.FLYING: "started",
    JobState.RETURNED: "returned",
}


def change_word(before: Job | None, after: Job) -> JobChangeWord:
    """`noted`: only the reason differs."""
    if before is None:
        return "queued"
    if after.state is not before.state:
        return _BY_STATE.get(after.state, "ended")
    if after.claim != before.claim:
        return "taken"
    if after.place != before.place:
        return "placed"
    if after.end_requested and not before.end_requested:
        return "end_requested"
    return "start_asked" if after.start_requested_at is not None and before.start_requested_at is None else "noted"


def was_broken_off(run: Run) -> bool:
    """Whether our restart ended it before anything was started: no fault of the vehicle."""
    nothing_started = run.reason is not None and run.reason.code is ReasonCode.RESTART_BEFORE_UPLOAD_ENDED
    return run.state is RunState.FAILED and run.started_at is None and nothing_started


def why_bad(run: Run) -> Reason | None:
    """Why nobody should fly on without looking; None for one that flew its mission and released every parcel.

    A parcel that is still on board, or may be, would fly with the next job.
    """
    if was_broken_off(run):
        return None
    if run.state is not RunState.COMPLETED:
        code = ReasonCode.RUN_BAD if run.reason is None else ReasonCode.RUN_BAD_BECAUSE
        return Reason.of(code, run.reason, run_id=run.id, state=run.state.value)
    for drop in run.last_drops:
        if drop.outcome is not DropOutcome.RELEASED:
            code = ReasonCode.DROP_BAD if drop.reason is None else ReasonCode.DROP_BAD_BECAUSE
            about = {"run_id": run.id, "plan_item_id": drop.plan_item_id, "outcome": drop.outcome.value}
            return Reason.of(code, drop.reason, **about)
    return None


# What becomes of a job that has a vehicle, by what its run has become. It only follows: nothing is commanded here.


NEVER_MADE = Reason.of(ReasonCode.JOB_RUN_NEVER_MADE)
STARTED_FIRST = Reason.of(ReasonCode.JOB_STARTED_FIRST)
WAITS_FOR_START = Reason.of(ReasonCode.JOB_WAITS_FOR_START)


def after(job: Job, run: Run | None, now: float) -> Job:
    """The job as its run makes it; the same one if nothing changed. `run` None: it was never made."""
    if run is None:
        return job.requeued(NEVER_MADE, now=now)
    if run.is_over:
        return _ended(job, run, now)
    if run.started_at is not None:
        if job.state is not JobState.FLYING:
            reason = STARTED_FIRST if job.end_requested else None
            return job.moved_to(JobState.FLYING, now=now, reason=reason, end_requested="")
        return job
    if job.state is JobState.PREPARING and run.state is RunState.UPLOADED:
        return job.moved_to(JobState.PREPARED, now=now, reason=None if job.auto_start else WAITS_FOR_START)
    if _start_failed(job, run) and run.reason != job.reason:
        return job.changed(now=now, reason=run.reason)
    return job


def must_be_taken_off(job: Job, run: Run, *, is_late: bool) -> bool:
    """Whether the run is to be ended on the ground, if its vehicle was not told to arm: the job was cancelled, or its
    latest start is over.
    """
    return run.state in BEFORE_FLIGHT and (bool(job.end_requested) or is_late)


def _start_failed(job: Job, run: Run) -> bool:
    """Whether the start that we asked for failed on the ground. We do not ask again; a person may. After a restart the
    job says so already.
    """
    asked_at = job.start_requested_at
    if asked_at is None or run.reason is None or run.reason.code is ReasonCode.RESTART_DURING_START_DISARMED:
        return False
    return run.state is RunState.UPLOADED and run.updated_at > asked_at


def _ended(job: Job, run: Run, now: float) -> Job:
    if run.started_at is None and run.state is not RunState.LOST and job.end_requested:
        return job.moved_to(JobState(job.end_requested), now=now, reason=job.reason)
    if run.started_at is None and run.state is RunState.ABORTED:
        return job.moved_to(JobState.CANCELLED, now=now, reason=Reason.of(ReasonCode.JOB_RUN_ENDED, run.reason))
    if was_broken_off(run) and job.state is JobState.PREPARING:
        return job.requeued(run.reason, now=now)
    bad = why_bad(run)
    return job.moved_to(JobState.COMPLETED if bad is None else JobState.FAILED, now=now, reason=bad)
