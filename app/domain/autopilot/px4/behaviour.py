"""What a vehicle with PX4 does. Its sources: mission_block.cpp, FeasibilityChecker; figures flown in SITL on v1.18."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.domain.autopilot.base import Quantity
from app.domain.autopilot.px4.parameters import NAMES, parameter, usable
from app.domain.autopilot.px4.versions import NPFG_SINCE, firmware
from app.domain.plan.walk import Carried
from app.domain.vehicle import VehicleFacts

ROVER_REACH_M: Final = 1.3
"""A rover at 2.1 m/s reaches its waypoint 1.1 to 1.3 m before it (flown)."""
LANDED_REACH_M: Final = 2.0
"""How far from its point a landed vehicle may stand and still be there."""
L1_SWITCH_S: Final = 4.77
"""The switch distance of older guidance is so much of ground speed."""
MAX_SWITCH_DISTANCE_M: Final = 500.0
GLIDE_MARGIN_DEG: Final = 0.1
"""PX4's own tolerance on FW_LND_ANG."""


@dataclass(frozen=True, slots=True)
class Px4Behaviour:
    """See Behaviour."""

    facts: VehicleFacts

    def quantity(self, which: Quantity) -> float:
        return parameter(self.facts, NAMES[which])

    def usable(self) -> VehicleFacts:
        return usable(self.facts)

    def switch_distance_m(self, ground_speed_m_s: float) -> float:
        """An unknown firmware gets the current law."""
        radius_m = parameter(self.facts, "NAV_ACC_RAD")
        version = firmware(self.facts)
        if version is not None and version < NPFG_SINCE:
            return max(radius_m, L1_SWITCH_S * ground_speed_m_s)
        period_s, damping = parameter(self.facts, "NPFG_PERIOD"), parameter(self.facts, "NPFG_DAMPING")
        seconds = period_s * damping * parameter(self.facts, "NPFG_SW_DST_MLT")
        return max(radius_m, min(MAX_SWITCH_DISTANCE_M, ground_speed_m_s * seconds))

    def reach_m(self, carried: Carried, ground_speed_m_s: float, acceptance_radius_m: float | None = None) -> float:
        """An item's own radius counts for rotary wings."""
        match carried:
            case Carried.ROTARY_WING:
                return parameter(self.facts, "NAV_ACC_RAD") if acceptance_radius_m is None else acceptance_radius_m
            case Carried.FIXED_WING:
                return self.switch_distance_m(ground_speed_m_s)
            case Carried.WHEELS:
                return ROVER_REACH_M
            case Carried.GROUND:
                return LANDED_REACH_M
            case Carried.BUOYANCY:
                return parameter(self.facts, "NAV_ACC_RAD")

    @property
    def steepest_glide_deg(self) -> float:
        return parameter(self.facts, "FW_LND_ANG") + GLIDE_MARGIN_DEG
