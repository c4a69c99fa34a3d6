"""The declared performance of vehicles, and which declaration applies to a vehicle."""

from __future__ import annotations

import re
from collections.abc import Mapping

from app.domain.autopilot import autopilot
from app.domain.vehicle.performance import Performance
from app.domain.vehicle.state import VehicleProfile, VehicleType

_KEY = re.compile(r"v\d{1,3}(-\d{1,3})?|[0-9a-f]{1,36}")

PerformanceRegistry = Mapping[str, Performance]
"""By UID (hex, as GET /api/v1/vehicles returns it), by ID (`v1`), or by vehicle type."""


def declared_for(
    declared: PerformanceRegistry, vehicle_id: str, uid: str | None, vehicle_type: VehicleType | None
) -> Performance | None:
    """Return the most specific entry: by UID, else by ID, else by type, else None."""
    for key in (uid, vehicle_id, vehicle_type):
        if key is not None and key in declared:
            return declared[key]
    return None


def require_known_keys(declared: PerformanceRegistry) -> None:
    """Validate the keys: a misspelled key would silently disable a check. Raises ValueError."""
    for key in declared:
        if key not in set(VehicleType) and not _KEY.fullmatch(key):
            types = ", ".join(VehicleType)
            raise ValueError(
                f"{key!r} does not identify a vehicle: use its UID (hex), its ID (v1), or a type ({types})"
            )


def default_facts(vehicle_type: VehicleType) -> VehicleProfile:
    """Return facts for checking a plan without a vehicle. `uid`, `firmware` and `home` are unknown."""
    return VehicleProfile(vehicle_type=vehicle_type, parameters=dict(autopilot().defaults[vehicle_type]))
