"""The declared performances of a fleet: which one is a vehicle's."""

from __future__ import annotations

import re
from collections.abc import Mapping

from app.domain.autopilot import autopilot
from app.domain.vehicle.performance import Performance
from app.domain.vehicle.state import VehicleProfile, VehicleType

_KEY = re.compile(r"v\d{1,3}(-\d{1,3})?|[0-9a-f]{1,36}")

Declared = Mapping[str, Performance]
"""By uid (hex, as GET /api/v1/vehicles tells it), by id (`v1`), or by vehicle type."""


def declared_for(
    declared: Declared, vehicle_id: str, uid: str | None, vehicle_type: VehicleType | None
) -> Performance | None:
    """The most special entry: by uid, else by id, else by type; None if there is none."""
    for key in (uid, vehicle_id, vehicle_type):
        if key is not None and key in declared:
            return declared[key]
    return None


def require_known_keys(declared: Declared) -> None:
    """A key that can be no vehicle's would silently check nothing. Raises ValueError."""
    for key in declared:
        if key not in set(VehicleType) and not _KEY.fullmatch(key):
            types = ", ".join(VehicleType)
            raise ValueError(f"{key!r} names no vehicle: write its uid (hex), its id (v1), or a type ({types})")


# What to assume of a vehicle that is not there.


def default_facts(vehicle_type: VehicleType) -> VehicleProfile:
    """Facts for checking a plan without a vehicle. `uid`, `firmware` and `home` stay unknown."""
    return VehicleProfile(vehicle_type=vehicle_type, parameters=dict(autopilot().defaults[vehicle_type]))
