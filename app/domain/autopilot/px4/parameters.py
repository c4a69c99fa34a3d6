"""PX4's parameters: name, default, and range for the prediction of each quantity."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal

from app.domain.autopilot.base import (
    FenceBreach,
    LinkLoss,
    LowBattery,
    MissionNeeds,
    Quantity,
    RallyReturn,
    Return,
    Setting,
)
from app.domain.vehicle.state import VehicleProfile, VehicleType

_COMMON: Final[Mapping[str, float | int]] = {
    "BAT_CRIT_THR": 0.07,
    "COM_LOW_BAT_ACT": 0,
    "MIS_DIST_1WP": 10_000,
    "MIS_COMMAND_TOUT": 0,
    "MIS_TKO_LAND_REQ": 0,
    "NAV_ACC_RAD": 10,
    "NAV_DLL_ACT": 0,
    "NAV_LOITER_RAD": 80,
    "PD_GRIPPER_TYPE": 0,
    "PD_GRIPPER_TO": 1,
    "GF_ACTION": 2,
    "GF_MAX_HOR_DIST": 0,
    "GF_MAX_VER_DIST": 0,
    "RTL_TYPE": 0,
    "RTL_RETURN_ALT": 30,
    "RTL_DESCEND_ALT": 30,
    "RTL_CONE_ANG": 45,
    "RTL_MIN_DIST": 10,
}
_ROTARY: Final[Mapping[str, float | int]] = {
    "MPC_XY_CRUISE": 5,
    "MPC_XY_VEL_MAX": 12,
    "MPC_Z_V_AUTO_UP": 3,
    "MPC_Z_V_AUTO_DN": 1.5,
    "MPC_TKO_SPEED": 1.5,
    "MPC_LAND_SPEED": 0.7,
    "MPC_LAND_ALT1": 10,
    "MPC_LAND_ALT2": 5,
    "MPC_ACC_HOR": 3,
    "MPC_ACC_UP_MAX": 4,
    "MPC_ACC_DOWN_MAX": 3,
    "MPC_JERK_AUTO": 4,
    "MPC_XY_TRAJ_P": 0.5,
    "MPC_TKO_RAMP_T": 3,
    "COM_SPOOLUP_TIME": 1,
    "MIS_TAKEOFF_ALT": 2.5,
}
_WING: Final[Mapping[str, float | int]] = {
    "MIS_TKO_LAND_REQ": 2,
    "RTL_TYPE": 1,
    "FW_AIRSPD_MIN": 10,
    "FW_AIRSPD_TRIM": 15,
    "FW_AIRSPD_MAX": 20,
    "FW_T_CLMB_R_SP": 3,
    "FW_T_SINK_R_SP": 2,
    "FW_LND_ANG": 5,
    "FW_LND_AIRSPD": -1,
    "FW_T_CLMB_MAX": 5,
    "NAV_FW_ALT_RAD": 10,
    "NAV_FW_ALTL_RAD": 5,
    "NPFG_PERIOD": 10,
    "NPFG_DAMPING": 0.7,
    "NPFG_SW_DST_MLT": 0.32,
}
DEFAULTS: Final[Mapping[VehicleType, Mapping[str, float | int]]] = {
    VehicleType.MULTICOPTER: {**_COMMON, **_ROTARY},
    VehicleType.FIXED_WING: {**_COMMON, **_WING},
    VehicleType.VTOL: {**_COMMON, **_ROTARY, **_WING, "VT_ARSP_TRANS": 10},
    VehicleType.ROVER: {**_COMMON, "RO_SPEED_LIM": 3, "NAV_ACC_RAD": 0.5},
    VehicleType.AIRSHIP: {**_COMMON, **_ROTARY, "MPC_XY_CRUISE": 4, "MPC_TKO_SPEED": 1},
}
"""The strict values where versions differ."""

ALSO_READ: Final = ("COM_OF_LOSS_T", "COM_OBL_RC_ACT", "COM_RC_IN_MODE", "COM_DL_LOSS_T", "COM_DISARM_PRFLT")
"""In addition to those with a default for rules."""

NAMES: Final[Mapping[Quantity, str]] = {
    Quantity.ACCEPTANCE_RADIUS_M: "NAV_ACC_RAD",
    Quantity.LOITER_RADIUS_M: "NAV_LOITER_RAD",
    Quantity.HOVER_CRUISE_M_S: "MPC_XY_CRUISE",
    Quantity.HOVER_FASTEST_M_S: "MPC_XY_VEL_MAX",
    Quantity.HOVER_ACCELERATION_M_S2: "MPC_ACC_HOR",
    Quantity.HOVER_JERK_M_S3: "MPC_JERK_AUTO",
    Quantity.CORNER_SHARE: "MPC_XY_TRAJ_P",
    Quantity.CLIMB_M_S: "MPC_Z_V_AUTO_UP",
    Quantity.CLIMB_ACCELERATION_M_S2: "MPC_ACC_UP_MAX",
    Quantity.SINK_M_S: "MPC_Z_V_AUTO_DN",
    Quantity.SINK_ACCELERATION_M_S2: "MPC_ACC_DOWN_MAX",
    Quantity.SPOOL_UP_S: "COM_SPOOLUP_TIME",
    Quantity.TAKEOFF_RAMP_S: "MPC_TKO_RAMP_T",
    Quantity.TAKEOFF_M_S: "MPC_TKO_SPEED",
    Quantity.TAKEOFF_HEIGHT_M: "MIS_TAKEOFF_ALT",
    Quantity.LANDING_M_S: "MPC_LAND_SPEED",
    Quantity.LANDING_SLOWS_BELOW_M: "MPC_LAND_ALT1",
    Quantity.LANDING_SLOW_BELOW_M: "MPC_LAND_ALT2",
    Quantity.WING_CRUISE_M_S: "FW_AIRSPD_TRIM",
    Quantity.WING_SLOWEST_M_S: "FW_AIRSPD_MIN",
    Quantity.WING_FASTEST_M_S: "FW_AIRSPD_MAX",
    Quantity.WING_CLIMB_M_S: "FW_T_CLMB_R_SP",
    Quantity.WING_SINK_M_S: "FW_T_SINK_R_SP",
    Quantity.WING_TAKEOFF_CLIMB_M_S: "FW_T_CLMB_MAX",
    Quantity.WING_LANDING_M_S: "FW_LND_AIRSPD",
    Quantity.WING_ALTITUDE_RADIUS_M: "NAV_FW_ALT_RAD",
    Quantity.WING_LANDING_ALTITUDE_RADIUS_M: "NAV_FW_ALTL_RAD",
    Quantity.GLIDE_DEG: "FW_LND_ANG",
    Quantity.TRANSITION_M_S: "VT_ARSP_TRANS",
    Quantity.WHEELS_FASTEST_M_S: "RO_SPEED_LIM",
    Quantity.GRIPPER_S: "PD_GRIPPER_TO",
    Quantity.RETURN_HEIGHT_M: "RTL_RETURN_ALT",
    Quantity.RETURN_NEAR_M: "RTL_MIN_DIST",
    Quantity.RETURN_CONE_DEG: "RTL_CONE_ANG",
    Quantity.COMMAND_WAIT_S: "MIS_COMMAND_TOUT",
    Quantity.FIRST_WAYPOINT_M: "MIS_DIST_1WP",
    Quantity.FARTHEST_M: "GF_MAX_HOR_DIST",
    Quantity.HIGHEST_M: "GF_MAX_VER_DIST",
}

LARGEST: Final = 1e5
"""In any unit: no distance, height, speed or time of a plan is longer."""
SMALLEST: Final = 0.01
_POSITIVE: Final = (
    *("NAV_ACC_RAD", "MPC_XY_TRAJ_P", "MPC_ACC_HOR", "MPC_ACC_UP_MAX", "MPC_ACC_DOWN_MAX", "MPC_JERK_AUTO"),
    *("MPC_Z_V_AUTO_UP", "MPC_Z_V_AUTO_DN", "MPC_TKO_SPEED", "MPC_LAND_SPEED", "NPFG_PERIOD", "NPFG_DAMPING"),
    *("NPFG_SW_DST_MLT", "FW_T_CLMB_R_SP", "FW_T_SINK_R_SP", "FW_T_CLMB_MAX", "VT_ARSP_TRANS"),
)
"""Used as divisors or under a root."""
_NOT_NEGATIVE: Final = (
    *("PD_GRIPPER_TO", "MPC_TKO_RAMP_T", "COM_SPOOLUP_TIME", "MPC_LAND_ALT1", "MPC_LAND_ALT2", "MIS_TAKEOFF_ALT"),
    *("NAV_FW_ALT_RAD", "NAV_FW_ALTL_RAD", "RTL_RETURN_ALT", "RTL_MIN_DIST"),
)
_FLOORS: Final[Mapping[str, float]] = {**dict.fromkeys(_POSITIVE, SMALLEST), **dict.fromkeys(_NOT_NEGATIVE, 0.0)}
_NOT_ZERO: Final = ("NAV_LOITER_RAD",)
"""The sign is the direction."""


def parameter(facts: VehicleProfile, name: str) -> float:
    """Return the value read from the vehicle, else the default; 0 if the vehicle type has none."""
    value = facts.parameters.get(name)
    if value is None:
        value = DEFAULTS[facts.vehicle_type].get(name)
        if value is not None:
            facts.assuming(name)
    return float(value or 0)


def reported(facts: VehicleProfile, name: str) -> float | int | None:
    """Return the value read from the vehicle; None if it did not report it or has none."""
    return facts.parameters.get(name)


def usable(facts: VehicleProfile) -> VehicleProfile:
    """Clamp each parameter to its range. A value that is not a number becomes the default of the type.

    PX4 accepts values that no vehicle can fly. Speeds are clamped where they are read: see app/domain/plan/walk.py.
    """
    within: dict[str, float | int] = {}
    for name, value in facts.parameters.items():
        if math.isfinite(value) and not (name in _NOT_ZERO and abs(value) < 1.0):
            within[name] = min(max(value, _FLOORS.get(name, -LARGEST)), LARGEST)
    return replace(facts, parameters=within)


_LINK_LOSS: Final[Mapping[int, Literal["continue", "hold", "return", "land"]]] = {
    0: "continue",
    1: "hold",
    2: "return",
    3: "land",
}
"""NAV_DLL_ACT. A plan cannot rely on 5 (terminate) and 6 (disarm)."""
_NOT_KEPT_INSIDE: Final = {0: "flies on", 1: "only warns and flies on", 4: "stops its motors for good"}
"""GF_ACTION."""
_ALONG_ITEMS: Final = (2, 4)
_CHOICES: Final = {
    0: "the nearest of home and the rally points",
    1: "the nearest of the rally points and the mission landing",
    3: "the nearest of home, the rally points and the mission landing",
    5: "the nearest rally point",
}
"""RTL_TYPE values that return to one place. The others follow the mission items, including skipped ones."""


def return_parameters(vehicle_type: VehicleType) -> tuple[str, ...]:
    """Parameters of `returns` and `rally_return`."""
    return ("RTL_TYPE", "RTL_LAND_DELAY", *(("RTL_APPR_FORCE",) if vehicle_type is VehicleType.VTOL else ()))


@dataclass(frozen=True, slots=True)
class Px4Settings:
    """The parts of a Behaviour that are settings of the operator."""

    facts: VehicleProfile

    @property
    def returns(self) -> Return:
        """RTL_TYPE: 0 home and rally points, 1 rally points and mission landing, 3 all of these, 5 rally points.

        2 and 4 follow the mission; 4 backwards if that has fewer items, 2 if there is no landing.
        """
        kind = int(parameter(self.facts, "RTL_TYPE"))
        return Return(
            to_home=kind not in (1, 5),
            to_landing=kind in (1, 3),
            along_items=kind in _ALONG_ITEMS,
            turns_back=kind == 4,
            may_follow_items=kind not in _CHOICES,
            choice=_CHOICES.get(kind, ""),
            rally_alone="with RTL_TYPE 5",
            setting=Setting("RTL_TYPE", kind, "set RTL_TYPE to 0 or 5"),
        )

    @property
    def rally_return(self) -> RallyReturn:
        """RTL_LAND_DELAY below 0 stays in the air. RTL_APPR_FORCE, in some firmware, requires landing approaches."""
        delay_s, force = reported(self.facts, "RTL_LAND_DELAY"), int(reported(self.facts, "RTL_APPR_FORCE") or 0)
        return RallyReturn(
            lands=None if delay_s is None else delay_s >= 0.0,
            lands_by="RTL_LAND_DELAY",
            passes_over=Setting("RTL_APPR_FORCE", force, "set RTL_APPR_FORCE to 0") if force else None,
        )

    @property
    def mission_needs(self) -> MissionNeeds:
        """MIS_TKO_LAND_REQ: 1 takeoff, 2 landing, 3 both, 4 both or neither, 5 like 4 but a landing is required in
        flight.
        """
        required = int(parameter(self.facts, "MIS_TKO_LAND_REQ"))
        return MissionNeeds(
            takeoff=required in (1, 3),
            landing=required in (2, 3),
            both_or_neither=required in (4, 5),
            landing_in_flight=required in (2, 3, 5),
            setting=Setting("MIS_TKO_LAND_REQ", required, "set MIS_TKO_LAND_REQ to 0"),
            without_takeoff="set MIS_TKO_LAND_REQ to 0, 2 or 5",
        )

    @property
    def fence_breach(self) -> FenceBreach:
        """GF_ACTION."""
        action = int(parameter(self.facts, "GF_ACTION"))
        setting = Setting("GF_ACTION", action, "set GF_ACTION to 2 (hold) or 3 (return)")
        return FenceBreach(_NOT_KEPT_INSIDE.get(action, ""), setting)

    @property
    def link_loss(self) -> LinkLoss:
        """NAV_DLL_ACT."""
        action = int(parameter(self.facts, "NAV_DLL_ACT"))
        return LinkLoss(_LINK_LOSS.get(action), Setting("NAV_DLL_ACT", action, "set NAV_DLL_ACT to 2 (return)"))

    @property
    def low_battery(self) -> LowBattery:
        """COM_LOW_BAT_ACT. Above 0 it acts at BAT_CRIT_THR."""
        action = int(parameter(self.facts, "COM_LOW_BAT_ACT"))
        remedy = "set COM_LOW_BAT_ACT to 3: return when critical, land in an emergency"
        acts_below = Setting("BAT_CRIT_THR", 100.0 * parameter(self.facts, "BAT_CRIT_THR")) if action > 0 else None
        return LowBattery(action == 0, acts_below, Setting("COM_LOW_BAT_ACT", action, remedy))
