"""What is shown of jobs and of the queues of vehicles."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

from app.domain.jobs.candidate import Candidate, Refusal
from app.domain.jobs.job import Job
from app.domain.jobs.vehicle_queue import VehicleQueue


class AssignmentView(BaseModel):
    """Which vehicle would get a job now, null if none can, and what speaks for and against each.

    `warning`: why waiting alone gives it to none of them; empty if it may.
    """

    model_config = ConfigDict(frozen=True)

    vehicle_id: str | None
    candidates: tuple[Candidate, ...]
    warning: str = ""


class VehicleQueueView(BaseModel):
    """One vehicle's queue. `ready`: a job could begin now, else `refusals` says why not.

    `job_id` is the job that it has, `waiting` are those that it may get, the next one first.
    """

    model_config = ConfigDict(frozen=True)

    queue: VehicleQueue
    ready: bool
    refusals: tuple[Refusal, ...]
    job_id: str | None
    waiting: tuple[str, ...]


class JobQueuesView(BaseModel):
    """All jobs that wait, the next one first, and each vehicle. `dispatching` false: a defect of ours, see the log."""

    model_config = ConfigDict(frozen=True)

    dispatching: bool
    capacity: int
    waiting: tuple[Job, ...]
    vehicles: tuple[VehicleQueueView, ...]
