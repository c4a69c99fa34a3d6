"""Facts that can be predicted with: a parameter may be set to what no vehicle can fly, and PX4 takes it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from app.domain.vehicle import VehicleFacts

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


def usable_facts(facts: VehicleFacts) -> VehicleFacts:
    """The same vehicle with each parameter within its bounds; one that is no number has its type's default.

    Speeds are bounded where they are read, see app/domain/speeds.py.
    """
    usable: dict[str, float | int] = {}
    for name, value in facts.parameters.items():
        if math.isfinite(value) and not (name in _NOT_ZERO and abs(value) < 1.0):
            usable[name] = min(max(value, _FLOORS.get(name, -LARGEST)), LARGEST)
    return replace(facts, parameters=usable)
