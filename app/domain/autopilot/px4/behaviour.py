"""The behaviour of PX4. Sources: mission_block.cpp, FeasibilityChecker; figures flown in SITL on v1.18."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.domain.autopilot.base import GripperAssignment, Quantity, Setting, TooOld
from app.domain.autopilot.px4 import gripper, versions
from app.domain.autopilot.px4.parameters import NAMES, Px4Settings, parameter, usable
from app.domain.vehicle.state import FlightRegime, VehicleProfile, VehicleType

ROVER_REACH_M: Final = 1.3
"""A rover at 2.1 m/s reaches its waypoint 1.1 to 1.3 m before the point (flown)."""
LANDED_REACH_M: Final = 2.0
"""Tolerance for a landed vehicle to be at its point."""
L1_SWITCH_S: Final = 4.77
"""Switch distance of L1 guidance, in seconds of ground speed."""
NPFG_SWITCH_S: Final = 2.24
"""Switch distance of NPFG guidance with default parameters, in seconds of ground speed."""
MAX_SWITCH_DISTANCE_M: Final = 500.0
GLIDE_MARGIN_DEG: Final = 0.1
"""PX4's own tolerance on FW_LND_ANG."""


@dataclass(frozen=True, slots=True)
class Px4Behaviour(Px4Settings):
    """See Behaviour."""

    def quantity(self, which: Quantity) -> float:
        return parameter(self.facts, NAMES[which])

    def usable(self) -> VehicleProfile:
        return usable(self.facts)

    def switch_distance_m(self, ground_speed_m_s: float) -> float:
        """Unknown firmware is assumed to be current."""
        radius_m = parameter(self.facts, "NAV_ACC_RAD")
        if versions.is_older(self.facts, versions.NPFG_SINCE):
            return max(radius_m, L1_SWITCH_S * ground_speed_m_s)
        period_s, damping = parameter(self.facts, "NPFG_PERIOD"), parameter(self.facts, "NPFG_DAMPING")
        seconds = period_s * damping * parameter(self.facts, "NPFG_SW_DST_MLT")
        return max(radius_m, min(MAX_SWITCH_DISTANCE_M, ground_speed_m_s * seconds))

    def reach_m(
        self, carried: FlightRegime, ground_speed_m_s: float, acceptance_radius_m: float | None = None
    ) -> float:
        """An item's own radius applies to rotary wings."""
        match carried:
            case FlightRegime.ROTARY_WING:
                return parameter(self.facts, "NAV_ACC_RAD") if acceptance_radius_m is None else acceptance_radius_m
            case FlightRegime.FIXED_WING:
                return self.switch_distance_m(ground_speed_m_s)
            case FlightRegime.WHEELS:
                return ROVER_REACH_M
            case FlightRegime.GROUND:
                return LANDED_REACH_M
            case FlightRegime.BUOYANCY:
                return parameter(self.facts, "NAV_ACC_RAD")

    def name_of(self, which: Quantity) -> str:
        return NAMES[which]

    @property
    def guidance_s(self) -> float:
        """The longer distance if the firmware is unknown."""
        return NPFG_SWITCH_S if versions.is_known_since(self.facts, versions.NPFG_SINCE) else L1_SWITCH_S

    @property
    def steepest_glide(self) -> Setting:
        return Setting("FW_LND_ANG", parameter(self.facts, "FW_LND_ANG") + GLIDE_MARGIN_DEG)

    @property
    def lowest_takeoff_m(self) -> float:
        if versions.is_known_since(self.facts, versions.TAKEOFF_ABOVE_HOME_ONLY_SINCE):
            return 0.0
        return parameter(self.facts, "NAV_ACC_RAD") + 1.0

    @property
    def refuses_far_first_waypoint(self) -> bool:
        return not versions.is_known_since(self.facts, versions.FIRST_WAYPOINT_WARNS_SINCE)

    @property
    def too_old_for_drops(self) -> TooOld | None:
        """Unknown firmware is assumed to be current."""
        return versions.too_old(self.facts, versions.PAYLOAD_ITEMS_SINCE)

    @property
    def no_gripper(self) -> Setting | None:
        kind = parameter(self.facts, "PD_GRIPPER_TYPE")
        return None if kind >= 0 else Setting("PD_GRIPPER_TYPE", kind, "set PD_GRIPPER_TYPE to 0")

    @property
    def gripper_output(self) -> GripperAssignment:
        return gripper.output(self.facts)

    @property
    def returns_round_fence(self) -> bool:
        """Unknown firmware: no."""
        return versions.is_known_since(self.facts, versions.ROUND_THE_FENCE_SINCE)

    @property
    def return_margin_m(self) -> float:
        """Twice NAV_ACC_RAD, or the loiter radius in fixed-wing flight."""
        wing = self.facts.vehicle_type in (VehicleType.FIXED_WING, VehicleType.VTOL)
        return abs(parameter(self.facts, "NAV_LOITER_RAD")) if wing else 2.0 * parameter(self.facts, "NAV_ACC_RAD")

    @property
    def needs_all_inclusions(self) -> bool:
        """Unknown firmware: yes."""
        return not versions.is_older(self.facts, versions.ALL_INCLUSIONS_SINCE)
