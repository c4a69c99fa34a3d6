"""The speeds that QGroundControl plans with: for its estimates only, a vehicle never gets them."""

from __future__ import annotations

from app.domain.carried import Carried
from app.domain.default_facts import default_facts
from app.domain.speeds import cruise_speed_m_s
from app.domain.vehicle import VehicleType

_ROTARY = frozenset({VehicleType.MULTICOPTER, VehicleType.AIRSHIP, VehicleType.ROVER})


def planning_speeds(vehicle_type: VehicleType, cruise_m_s: float | None) -> dict[str, float]:
    """`cruiseSpeed` (wings) and `hoverSpeed` of a .plan, out of the plan's cruise speed or the vehicle's usual ones."""
    wings = cruise_speed_m_s(default_facts(VehicleType.FIXED_WING), Carried.FIXED_WING)
    rotors = cruise_speed_m_s(default_facts(VehicleType.MULTICOPTER), Carried.ROTARY_WING)
    if cruise_m_s is not None:
        wings, rotors = (wings, cruise_m_s) if vehicle_type in _ROTARY else (cruise_m_s, rotors)
    return {"cruiseSpeed": wings, "hoverSpeed": rotors}
