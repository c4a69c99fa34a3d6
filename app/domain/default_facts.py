"""What to assume of a vehicle that is not there."""

from __future__ import annotations

from app.domain.autopilot import autopilot
from app.domain.vehicle import VehicleFacts, VehicleType


def default_facts(vehicle_type: VehicleType) -> VehicleFacts:
    """Facts for checking a plan without a vehicle. `uid`, `firmware` and `home` stay unknown."""
    return VehicleFacts(vehicle_type=vehicle_type, parameters=dict(autopilot().defaults[vehicle_type]))
