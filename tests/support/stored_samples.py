"""Things to store."""

from __future__ import annotations

from app.domain.drop.record import DropRecord
from app.domain.events import NewEvent
from app.domain.ports.stores import StoredAnswer, StoredPlan, StoredToken
from app.domain.run.run import Run, RunState
from app.domain.vehicle.state import VehicleType
from tests.support.events import item


def event(number: int = 0, run_id: str | None = None, item_id: str | None = None) -> NewEvent:
    return NewEvent.of(item(number, item_id), 1000.0 + number, vehicle_id="v1", run_id=run_id)


def plan(number: int = 1) -> StoredPlan:
    return StoredPlan(
        id=f"plan-{number}",
        hash="sha256:0",
        name=f"clinic run {number}",
        vehicle_type=VehicleType.MULTICOPTER,
        created_at=1000.0,
        created_by="ward 3",
        document={
            "version": 1,
            "items": [{"type": "takeoff", "relative_altitude_m": 12.5}],
            "note": "größe ☂",
            "x": None,
        },
    )


def run(number: int = 1, *, vehicle_id: str = "v1", state: RunState = RunState.CREATED, plan_id: str = "plan-1") -> Run:
    return Run(
        id=f"run-{number}",
        plan_id=plan_id,
        plan_hash="sha256:0",
        vehicle_id=vehicle_id,
        state=state,
        drops=(DropRecord(plan_item_id="drop-1", supervised=True),),
        created_at=1000.0,
        updated_at=1000.0,
    )


def token(number: int = 1) -> StoredToken:
    return StoredToken(
        id=f"token-{number}",
        name=f"ward {number}",
        role="dispatcher",
        token_hash=f"hash-{number}",
        created_at=1000.0,
        expires_at=9000.0 + number,
    )


def answer(key: str = "key-1", *, body: bytes = b'{"id": "run-1"}', request_hash: str = "request-1") -> StoredAnswer:
    return StoredAnswer(
        key=key, request_hash=request_hash, status=201, headers={"Location": "/api/v1/runs/run-1"}, body=body
    )
