"""Jobs, runs and vehicles for tests of the queue."""

from __future__ import annotations

from app.domain.drop.record import Certainty, DropOutcome, DropRecord
from app.domain.jobs.job import Job, VehicleSelector
from app.domain.run.run import Run, RunState
from app.domain.vehicle.state import LandedState, VehicleState, VehicleType

READY = VehicleState(connected=True, armed=False, landed=LandedState.ON_GROUND, battery_percent=80.0)


def a_job(number: int = 1, *, vehicle: str = "any", **changes: object) -> Job:
    """A job that waits."""
    job = Job(
        id=f"job-{number}",
        plan_id="plan-1",
        plan_hash="sha256:0",
        plan_name="a round",
        vehicle_type=VehicleType.MULTICOPTER,
        selector=VehicleSelector(vehicle=vehicle),
        rank=number,
        created_at=1.0,
        updated_at=1.0,
    )
    return job.model_copy(update=changes)


def a_run(state: RunState, **changes: object) -> Run:
    """A run with one drop that was released."""
    drop = DropRecord(
        plan_item_id="drop", supervised=True, outcome=DropOutcome.RELEASED, certainty=Certainty.ACKNOWLEDGED
    )
    run = Run(
        id="run-1", plan_id="plan-1", plan_hash="ab", vehicle_id="v1", drops=(drop,), created_at=1.0, updated_at=1.0
    )
    return run.model_copy(update={"state": state, **changes})
