"""A run as it begins: what it flies, with which vehicle, and whose it is."""

from __future__ import annotations

import secrets

from app.domain.flight.leg import drop_records
from app.domain.mission import Mission, mission_hash
from app.domain.ports import StoredPlan, VehicleIdentity
from app.domain.prediction import Wind
from app.domain.run import Run


def new_run_id() -> str:
    """An id that no other run has."""
    return f"run-{secrets.token_hex(6)}"


def new_run(
    run_id: str,
    stored: StoredPlan,
    vehicle_id: str,
    identity: VehicleIdentity,
    mission: Mission,
    wind: Wind,
    continues: str | None,
    *,
    start: bool,
    by: str,
    now: float,
) -> Run:
    """A run of this plan that is about to be uploaded. `continues` is the run whose rest it flies."""
    return Run(
        id=run_id,
        plan_id=stored.id,
        plan_hash=stored.hash,
        vehicle_id=vehicle_id,
        vehicle_uid=identity.uid,
        vehicle_type=identity.vehicle_type,
        firmware=None if identity.firmware is None else str(identity.firmware),
        mission_hash=mission_hash(mission),
        requested_by=by,
        start_requested=start,
        wind=wind,
        continues=continues,
        drops=drop_records(mission),
        created_at=now,
        updated_at=now,
    )
