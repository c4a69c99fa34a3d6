"""What carries a vehicle: this decides whether it can stop."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import Final

from app.domain.in_flight import InFlight
from app.domain.vehicle import VehicleType


class Carried(StrEnum):
    """What carries the vehicle."""

    GROUND = "ground"
    ROTARY_WING = "rotary_wing"
    FIXED_WING = "fixed_wing"
    WHEELS = "wheels"
    BUOYANCY = "buoyancy"


IN_AIR: Final[Mapping[VehicleType, Carried]] = {
    VehicleType.MULTICOPTER: Carried.ROTARY_WING,
    VehicleType.FIXED_WING: Carried.FIXED_WING,
    VehicleType.VTOL: Carried.ROTARY_WING,
    VehicleType.ROVER: Carried.WHEELS,
    VehicleType.AIRSHIP: Carried.BUOYANCY,
}
"""After a takeoff by itself; a rover drives."""


def carried_in_flight(vehicle_type: VehicleType, in_flight: InFlight | None = None) -> Carried:
    """What carries a vehicle that flies, or drives, now; by itself a VTOL hovers."""
    if vehicle_type is VehicleType.VTOL and in_flight is not None and in_flight.wing_borne:
        return Carried.FIXED_WING
    return IN_AIR[vehicle_type]
