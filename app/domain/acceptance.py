"""When PX4 calls a position "reached": how far before it the mission moves on, and so how early an item there acts.

Source: PX4 mission_block.cpp and its fixed-wing guidance; figures flown in SITL on v1.18.
"""

from __future__ import annotations

from app.domain.default_facts import firmware, parameter
from app.domain.plan.walk import Carried
from app.domain.vehicle import FirmwareVersion, VehicleFacts

STOP_RADIUS_M = 1.0
"""Acceptance radius of a stop. Flown: 1 m with a hold stops 0.9 m away at 0.1 m/s; the default 10 m does not stop."""
ROVER_REACH_M = 1.3
"""A rover at 2.1 m/s reaches its waypoint 1.1 to 1.3 m before it (flown)."""
LANDED_REACH_M = 2.0
"""How far from its point a landed vehicle may stand and still be there."""
NPFG_SINCE = FirmwareVersion(1, 14, 0)
L1_SWITCH_S = 4.77
"""Older firmware (L1 guidance): the switch distance is 4.77 s of ground speed."""
MAX_SWITCH_DISTANCE_M = 500.0


def switch_distance_m(facts: VehicleFacts, ground_speed_m_s: float) -> float:
    """Fixed wing: how far before the waypoint the guidance switches to the next, and the item counts as reached.

    An unknown firmware gets the current law; `parameter` fills in the defaults.
    """
    radius_m = parameter(facts, "NAV_ACC_RAD")
    version = firmware(facts)
    if version is not None and version < NPFG_SINCE:
        return max(radius_m, L1_SWITCH_S * ground_speed_m_s)
    seconds = parameter(facts, "NPFG_PERIOD") * parameter(facts, "NPFG_DAMPING") * parameter(facts, "NPFG_SW_DST_MLT")
    return max(radius_m, min(MAX_SWITCH_DISTANCE_M, ground_speed_m_s * seconds))


def reach_m(
    facts: VehicleFacts, carried: Carried, ground_speed_m_s: float, acceptance_radius_m: float | None = None
) -> float:
    """Distance before the point at which an item counts as reached. An item's own radius counts for rotary wings."""
    match carried:
        case Carried.ROTARY_WING:
            return parameter(facts, "NAV_ACC_RAD") if acceptance_radius_m is None else acceptance_radius_m
        case Carried.FIXED_WING:
            return switch_distance_m(facts, ground_speed_m_s)
        case Carried.WHEELS:
            return ROVER_REACH_M
        case Carried.GROUND:
            return LANDED_REACH_M
        case Carried.BUOYANCY:
            return parameter(facts, "NAV_ACC_RAD")
