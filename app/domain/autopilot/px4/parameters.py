"""PX4's parameters: what each quantity is called, its default, and the bounds within which it can be predicted with."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from app.domain.autopilot.base import Quantity
from app.domain.vehicle import VehicleFacts, VehicleType

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
"""The strict ones where versions differ."""

ALSO_READ: Final = ("COM_OF_LOSS_T", "COM_OBL_RC_ACT", "COM_RC_IN_MODE", "COM_DL_LOSS_T", "COM_DISARM_PRFLT")
"""Besides those that rules have a default for."""

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
"""In any unit: no way, height, speed or time of a plan is longer."""
SMALLEST: Final = 0.01
_POSITIVE: Final = (
    *("NAV_ACC_RAD", "MPC_XY_TRAJ_P", "MPC_ACC_HOR", "MPC_ACC_UP_MAX", "MPC_ACC_DOWN_MAX", "MPC_JERK_AUTO"),
    *("MPC_Z_V_AUTO_UP", "MPC_Z_V_AUTO_DN", "MPC_TKO_SPEED", "MPC_LAND_SPEED", "NPFG_PERIOD", "NPFG_DAMPING"),
    *("NPFG_SW_DST_MLT", "FW_T_CLMB_R_SP", "FW_T_SINK_R_SP", "FW_T_CLMB_MAX", "VT_ARSP_TRANS"),
)
"""Divided by, or under a root."""
_NOT_NEGATIVE: Final = (
    *("PD_GRIPPER_TO", "MPC_TKO_RAMP_T", "COM_SPOOLUP_TIME", "MPC_LAND_ALT1", "MPC_LAND_ALT2", "MIS_TAKEOFF_ALT"),
    *("NAV_FW_ALT_RAD", "NAV_FW_ALTL_RAD", "RTL_RETURN_ALT", "RTL_MIN_DIST"),
)
_FLOORS: Final[Mapping[str, float]] = {**dict.fromkeys(_POSITIVE, SMALLEST), **dict.fromkeys(_NOT_NEGATIVE, 0.0)}
_NOT_ZERO: Final = ("NAV_LOITER_RAD",)
"""Its sign is the direction."""


def parameter(facts: VehicleFacts, name: str) -> float:
    """As read from the vehicle, else its default. 0 if the vehicle type has none."""
    value = facts.parameters.get(name)
    if value is None:
        value = DEFAULTS[facts.vehicle_type].get(name)
        if value is not None:
            facts.assuming(name)
    return float(value or 0)


def told(facts: VehicleFacts, name: str) -> float | int | None:
    """As read from the vehicle; None if it does not tell it or has none."""
    return facts.parameters.get(name)


def usable(facts: VehicleFacts) -> VehicleFacts:
    """Each parameter within its bounds; one that is no number has its type's default.

    PX4 takes what no vehicle can fly. Speeds are bounded where they are read, see app/domain/speeds.py.
    """
    within: dict[str, float | int] = {}
    for name, value in facts.parameters.items():
        if math.isfinite(value) and not (name in _NOT_ZERO and abs(value) < 1.0):
            within[name] = min(max(value, _FLOORS.get(name, -LARGEST)), LARGEST)
    return replace(facts, parameters=within)
