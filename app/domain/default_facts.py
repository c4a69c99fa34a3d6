"""What to assume of a vehicle that is not there or does not tell: PX4 defaults, the strict ones where they differ."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from app.domain.vehicle import FirmwareVersion, VehicleFacts, VehicleType

FIRMWARE: Final = "firmware"
HOME: Final = "home"
"""Names of facts that are no parameters."""

_COMMON: Mapping[str, float | int] = {
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
_ROTARY: Mapping[str, float | int] = {
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
_WING: Mapping[str, float | int] = {
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
_OF_TYPE: Mapping[VehicleType, Mapping[str, float | int]] = {
    VehicleType.MULTICOPTER: _ROTARY,
    VehicleType.FIXED_WING: _WING,
    VehicleType.VTOL: {**_ROTARY, **_WING, "VT_ARSP_TRANS": 10},
    VehicleType.ROVER: {"RO_SPEED_LIM": 3, "NAV_ACC_RAD": 0.5},
    VehicleType.AIRSHIP: {**_ROTARY, "MPC_XY_CRUISE": 4, "MPC_TKO_SPEED": 1},
}


def default_facts(vehicle_type: VehicleType) -> VehicleFacts:
    """Facts for checking a plan without a vehicle. `uid`, `firmware` and `home` stay unknown."""
    return VehicleFacts(vehicle_type=vehicle_type, parameters={**_COMMON, **_OF_TYPE[vehicle_type]})


def parameter(facts: VehicleFacts, name: str) -> float:
    """A PX4 parameter as read from the vehicle, else its default. 0 if the vehicle type has none."""
    value = facts.parameters.get(name)
    if value is None:
        value = default_facts(facts.vehicle_type).parameters.get(name)
        if value is not None:
            facts.assuming(name)
    return float(value or 0)


def firmware(facts: VehicleFacts) -> FirmwareVersion | None:
    """The version; None if the vehicle does not tell it: what is assumed then is up to who asks."""
    if facts.firmware is None:
        facts.assuming(FIRMWARE)
    return facts.firmware
