"""Every rule finds the plan that breaks it, at the right place, and leaves the nearest right plan alone."""

from __future__ import annotations

from tests.support.target_cases import TARGET_CASES
from tests.unit.domain.rules.alternate_cases import ALTERNATE_CASES, DETOUR_CASES
from tests.unit.domain.rules.bounds_cases import LIMIT_CASES, RETURN_CASES, VEHICLE_CASES
from tests.unit.domain.rules.drop_cases import BRAKING_CASES, CONSENT_CASES, POSITION_CASES
from tests.unit.domain.rules.fence_cases import GEOFENCE_CASES
from tests.unit.domain.rules.flight_cases import COMMAND_CASES, FIXED_WING_CASES, TAKEOFF_LANDING_CASES, VTOL_CASES
from tests.unit.domain.rules.payload_cases import BATTERY_CASES, PAYLOAD_CASES, WIND_CASES

CASES = [
    *POSITION_CASES,
    *BRAKING_CASES,
    *CONSENT_CASES,
    *TARGET_CASES,
    *ALTERNATE_CASES,
    *DETOUR_CASES,
    *TAKEOFF_LANDING_CASES,
    *VTOL_CASES,
    *FIXED_WING_CASES,
    *COMMAND_CASES,
    *GEOFENCE_CASES,
    *LIMIT_CASES,
    *RETURN_CASES,
    *VEHICLE_CASES,
    *PAYLOAD_CASES,
    *BATTERY_CASES,
    *WIND_CASES,
]
