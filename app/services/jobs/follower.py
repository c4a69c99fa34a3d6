"""Follows the jobs that have a vehicle: takes runs off it that are not to fly, and starts those that may start."""

from __future__ import annotations

from contextlib import suppress

from app.domain.errors import ConflictError, JobWrongStateError, NotFoundError, WaydropError
from app.domain.jobs.assignment import why_not_ready
from app.domain.jobs.job import Job, JobState, after, must_be_taken_off
from app.domain.jobs.queue import VehicleQueue
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import Run, RunState
from app.services.clock import Clock
from app.services.jobs.availability import VehicleAvailability
from app.services.jobs.deadlines import Deadlines
from app.services.jobs.repository import JobRepository
from app.services.jobs.withdrawal import Withdrawal
from app.services.runs import Runs

EXPIRED = Reason.of(ReasonCode.JOB_EXPIRED)


class _NotNowError(ConflictError):
    """The conditions that were checked before a start have changed."""

    def __init__(self, why: Reason) -> None:
        super().__init__("the run cannot be started now")
        self.why = why


class JobFollower:
    """Follows one job at a time. A start is stored as requested first and never requested again: after a restart of
    Waydrop an operator decides.
    """

    def __init__(
        self,
        repository: JobRepository,
        runs: Runs,
        availability: VehicleAvailability,
        clock: Clock,
        deadlines: Deadlines,
    ) -> None:
        self._repository = repository
        self._runs = runs
        self._withdrawal = Withdrawal(runs, repository)
        self._availability = availability
        self._clock = clock
        self._deadlines = deadlines

    async def follow(self, job: Job) -> None:
        """Poll once. Raises StorageError, and the errors of starting or ending the run."""
        run = await self._run_of(job)
        if run is not None and must_be_taken_off(job, run, is_late=self._is_late(job, run)):
            with suppress(JobWrongStateError):  # it has been told to arm: the next poll finds it in flight
                await self._repository.change(job.id, self._taken_off)
            return
        job = await self._repository.change(
            job.id,
            lambda current: after(current, run, self._clock.now()),
            also=lambda before, changed, queue: self._judged(before, changed, run, queue),
        )
        if run is not None and run.state is RunState.UPLOADED and _may_be_started(job):
            await self._start(job, run)

    def _is_late(self, job: Job, run: Run) -> bool:
        """A start that waits to arm ends at once: it must not arm after the deadline."""
        has_passed = self._deadlines.has_passed(job)
        return has_passed or (run.state is RunState.STARTING and job.is_late(self._clock.now()))

    async def note_unknown_start(self, job: Job) -> None:
        """After a restart of Waydrop: record for a run that was being started that it is not started again
        automatically.
        """
        if job.state is JobState.PREPARED and job.start_requested_at is not None:
            await self._note(job, Reason.of(ReasonCode.JOB_START_UNKNOWN))

    def _judged(self, before: Job, job: Job, run: Run | None, queue: VehicleQueue) -> VehicleQueue:
        if run is None or not job.is_over:
            return queue
        taken_off = before.end_requested and run.started_at is None and run.state is RunState.ABORTED
        return queue.cleared(run.id) if taken_off else queue.judged(run, now=self._clock.now())

    async def _run_of(self, job: Job) -> Run | None:
        try:
            return await self._runs.get(job.run_id or "")
        except NotFoundError:
            return None

    def _taken_off(self, job: Job) -> Job:
        """The run is ended before that is stored: nothing starts it meanwhile. Raises JobWrongStateError."""
        self._withdrawal.withdraw(job)
        if job.end_requested:
            return job
        return job.changed(now=self._clock.now(), end_requested="expired", reason=EXPIRED)

    async def _start(self, job: Job, run: Run) -> None:
        if not self._availability.has(run.vehicle_id, run.id) or job.is_late(self._clock.now()):
            return
        if why := self._why_unready(run):
            await self._note(job, why)
            return
        asked = await self._repository.change(job.id, self._asked)
        if asked.start_requested_at is None:
            return  # it was cancelled meanwhile
        try:
            await self._runs.start(run.id, last_check=lambda: self._check_again(job.id, run))
        except _NotNowError as error:
            why = error.why
            await self._repository.change(job.id, lambda current: _unasked(current, why, self._clock.now()))
        except WaydropError as error:
            await self._note(asked, Reason.of_error(error.code, error.detail))

    def _asked(self, job: Job) -> Job:
        now = self._clock.now()
        return job.changed(now=now, start_requested_at=now, reason=None) if _may_be_started(job) else job

    def _check_again(self, job_id: str, run: Run) -> None:
        """The disk, the vehicle's facts and the rules took their time: all that could forbid the start, once more."""
        job = self._repository.queue.jobs.get(job_id)
        if job is None or job.state is not JobState.PREPARED or job.end_requested:
            raise _NotNowError(Reason.of(ReasonCode.JOB_IS_TO_END))
        why = EXPIRED if job.is_late(self._clock.now()) else self._why_unready(run)
        if why is not None:
            raise _NotNowError(why)

    def _why_unready(self, run: Run) -> Reason | None:
        refusals = why_not_ready(self._availability.one(run.vehicle_id, run.id))
        if not refusals:
            return None
        first = refusals[0]
        return Reason.of(ReasonCode.JOB_NOT_READY, first.reason, code=first.code, refusal=first.message)

    async def _note(self, job: Job, reason: Reason) -> None:
        await self._repository.change(job.id, lambda current: _because(current, reason, self._clock.now()))


def _because(job: Job, reason: Reason, now: float) -> Job:
    return job if job.reason == reason else job.changed(now=now, reason=reason)


def _unasked(job: Job, reason: Reason, now: float) -> Job:
    """It was not started after all, and may be later. Of a job that is to end, the reason of that stays."""
    return job.changed(now=now, start_requested_at=None, reason=job.reason if job.end_requested else reason)


def _may_be_started(job: Job) -> bool:
    wanted = job.auto_start and job.state is JobState.PREPARED
    return wanted and job.start_requested_at is None and not job.end_requested
