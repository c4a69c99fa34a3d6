"""How long it takes to go up, to come down, and to land."""

from __future__ import annotations

from app.domain.default_facts import parameter
from app.domain.plan.walk import Carried
from app.domain.vehicle import VehicleFacts

TOUCHDOWN_S = 2.0
"""From touching the ground to "landed" (land detector)."""
_SLOWEST_M_S = 0.1


def climb_s(facts: VehicleFacts, carried: Carried, height_m: float) -> float:
    """Seconds for a change of altitude, up (+) or down (-). Wheels stay on the ground."""
    if carried is Carried.WHEELS:
        return 0.0
    wing = carried is Carried.FIXED_WING
    up, down = ("FW_T_CLMB_R_SP", "FW_T_SINK_R_SP") if wing else ("MPC_Z_V_AUTO_UP", "MPC_Z_V_AUTO_DN")
    rate_m_s = parameter(facts, up if height_m > 0 else down)
    return abs(height_m) / max(rate_m_s, _SLOWEST_M_S)


def touchdown_s(facts: VehicleFacts, height_m: float) -> float:
    """A vertical landing: full speed down to MPC_LAND_ALT1, slower to MPC_LAND_ALT2, then MPC_LAND_SPEED."""
    fast = max(parameter(facts, "MPC_Z_V_AUTO_DN"), _SLOWEST_M_S)
    slow = max(parameter(facts, "MPC_LAND_SPEED"), _SLOWEST_M_S)
    upper = max(parameter(facts, "MPC_LAND_ALT1"), parameter(facts, "MPC_LAND_ALT2"))
    lower = parameter(facts, "MPC_LAND_ALT2")
    height = max(0.0, height_m)
    seconds = max(0.0, height - upper) / fast
    seconds += max(0.0, min(height, upper) - lower) / ((fast + slow) / 2)
    return seconds + min(height, lower) / slow + TOUCHDOWN_S
