"""Keeps runs of jobs from being started, as long as that is certain: until an arming is sent to the vehicle."""

from __future__ import annotations

from app.domain.errors import JobWrongStateError, WrongStateError
from app.domain.jobs.job import Job, JobState
from app.domain.reasons import Reason, ReasonCode
from app.services.jobs.repository import JobRepository
from app.services.runs import Runs


class Withdrawal:
    """Nothing is awaited: what it promises is true when it returns."""

    def __init__(self, runs: Runs, repository: JobRepository) -> None:
        self._runs = runs
        self._repository = repository

    def withdraw(self, job: Job) -> None:
        """End the run of a job, if it has one, before its vehicle is armed. The caller stores why.

        Raises JobWrongStateError: an arming was sent, or it flies.
        """
        if job.run_id is None or job.state is JobState.FLYING:
            return
        try:
            self._runs.withdraw(job.run_id)
        except WrongStateError as error:
            raise JobWrongStateError(
                f"job {job.id} is being started: return or abort its run {job.run_id}",
                hint="get the job to see its state",
                state=job.state.value,
            ) from error

    def hold_back(self, vehicle_id: str, why: Reason) -> None:
        """The queue of a vehicle was stopped: a start of its job ends, and waits for a person."""
        job = self._repository.queue.holder_of(vehicle_id)
        if job is not None and job.run_id is not None:
            self._runs.hold_back(job.run_id, Reason.of(ReasonCode.START_HELD_BACK, why))
