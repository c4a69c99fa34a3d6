"""The parameters of one vehicle: PX4's names, types and defaults, and the PARAM messages' packing."""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterator, Mapping

Value = int | float

MAV_PARAM_TYPE_INT32 = 6
MAV_PARAM_TYPE_REAL32 = 9

DEFAULTS: dict[str, Value] = {
    "BAT1_CAPACITY": -1.0,
    "BAT_CRIT_THR": 0.07,
    "BAT_EMERGEN_THR": 0.05,
    "BAT_LOW_THR": 0.15,
    "COM_ARM_WO_GPS": 0,
    "COM_DISARM_LAND": 2.0,
    "COM_DISARM_PRFLT": 10.0,
    "COM_DL_LOSS_T": 10,
    "COM_FAIL_ACT_T": 5.0,
    "COM_LOW_BAT_ACT": 0,
    "COM_OBL_RC_ACT": 0,
    "COM_OF_LOSS_T": 1.0,
    "COM_RC_IN_MODE": 4,
    "COM_SPOOLUP_TIME": 1.0,
    "FW_AIRSPD_MAX": 20.0,
    "FW_AIRSPD_MIN": 10.0,
    "FW_AIRSPD_TRIM": 15.0,
    "FW_GPSF_LT": 30,
    "FW_GPSF_R": 15.0,
    "FW_LND_ANG": 5.0,
    "FW_R_LIM": 50.0,
    "FW_T_CLMB_R_SP": 3.0,
    "FW_T_SINK_R_SP": 2.0,
    "GF_ACTION": 2,
    "GF_MAX_HOR_DIST": 0.0,
    "GF_MAX_VER_DIST": 0.0,
    "LNDFW_AIRSPD_MAX": 6.0,
    "LNDFW_ROT_MAX": 0.5,
    "LNDFW_TRIG_TIME": 2.0,
    "LNDFW_VEL_XY_MAX": 5.0,
    "LNDFW_VEL_Z_MAX": 1.0,
    "LNDFW_XYACC_MAX": 8.0,
    "LNDMC_ALT_GND": 2.0,
    "LNDMC_ROT_MAX": 20.0,
    "LNDMC_TRIG_TIME": 1.0,
    "LNDMC_XY_VEL_MAX": 1.5,
    "LNDMC_Z_VEL_MAX": 0.25,
    "LND_FLIGHT_T_HI": 0,
    "LND_FLIGHT_T_LO": 0,
    "MAV_SYS_ID": 1,
    "MAV_TYPE": 2,
    "MIS_COMMAND_TOUT": 0.0,
    "MIS_DIST_1WP": 10000.0,
    "MIS_TAKEOFF_ALT": 2.5,
    "MIS_TKO_LAND_REQ": 0,
    "MIS_YAW_ERR": 12.0,
    "MIS_YAW_TMT": -1.0,
    "MPC_ACC_DOWN_MAX": 3.0,
    "MPC_ACC_HOR": 3.0,
    "MPC_ACC_UP_MAX": 4.0,
    "MPC_JERK_AUTO": 4.0,
    "MPC_LAND_ALT1": 10.0,
    "MPC_LAND_ALT2": 5.0,
    "MPC_LAND_SPEED": 0.7,
    "MPC_MANTHR_MIN": 0.08,
    "MPC_THR_HOVER": 0.5,
    "MPC_THR_MIN": 0.12,
    "MPC_TKO_RAMP_T": 3.0,
    "MPC_TKO_SPEED": 1.5,
    "MPC_USE_HTE": 1,
    "MPC_XY_CRUISE": 5.0,
    "MPC_XY_ERR_MAX": 2.0,
    "MPC_XY_TRAJ_P": 0.5,
    "MPC_XY_VEL_MAX": 12.0,
    "MPC_Z_ERR_MAX": 1.0,
    "MPC_Z_VEL_MAX_DN": 1.5,
    "MPC_Z_VEL_MAX_UP": 3.0,
    "MPC_Z_V_AUTO_DN": 1.5,
    "MPC_Z_V_AUTO_UP": 3.0,
    "NAV_ACC_RAD": 10.0,
    "NAV_DLL_ACT": 0,
    "NAV_FW_ALTL_RAD": 5.0,
    "NAV_FW_ALT_RAD": 10.0,
    "NAV_LOITER_RAD": 80.0,
    "NAV_MC_ALT_RAD": 0.8,
    "NAV_RCL_ACT": 2,
    "NPFG_DAMPING": 0.7,
    "NPFG_PERIOD": 10.0,
    "NPFG_SW_DST_MLT": 0.32,
    "PD_GRIPPER_TO": 1.0,
    "PD_GRIPPER_TYPE": 0,
    "RTL_DESCEND_ALT": 30.0,
    "RTL_LAND_DELAY": 0.0,
    "RTL_LOITER_RAD": 80.0,
    "RTL_MIN_DIST": 10.0,
    "RTL_RETURN_ALT": 30.0,
    "RTL_TYPE": 0,
    "RWTO_RAMP_TIME": 2.0,
    "SYS_AUTOSTART": 0,
    "SYS_HAS_NUM_ASPD": 1,
    "VT_ARSP_TRANS": 10.0,
    "VT_PSHER_SLEW": 0.33,
    "VT_TRANS_MIN_TM": 2.0,
}


class ParamError(Exception):
    """A parameter request that PX4 answers with PARAM_ERROR; `code` is MAV_PARAM_ERROR."""

    DOES_NOT_EXIST = 1
    TYPE_MISMATCH = 7

    def __init__(self, code: int) -> None:
        super().__init__(f"PARAM_ERROR {code}")
        self.code = code


class Params:
    """Name to value; the type of a default is the type for good, as in the autopilot."""

    def __init__(self, *overrides: Mapping[str, Value], absent: Collection[str] = ()) -> None:
        self._values: dict[str, Value] = {name: value for name, value in DEFAULTS.items() if name not in absent}
        for layer in overrides:
            for name, value in layer.items():
                known = self._values.get(name, value)
                self._values[name] = float(value) if isinstance(known, float) else int(value)
        self._names = sorted(self._values)
        self.version = 0
        """Counts the changes: what is derived from parameters in every cycle is derived once."""

    def __getitem__(self, name: str) -> Value:
        return self._values[name]

    def __contains__(self, name: str) -> bool:
        return name in self._values

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def integer(self, name: str) -> int:
        """An int32 parameter's value."""
        return int(self._values[name])

    def index_of(self, name: str) -> int:
        """`param_index` of PARAM_VALUE."""
        return self._names.index(name)

    def name_at(self, index: int) -> str:
        """The parameter with this `param_index`. Raises ParamError."""
        if not 0 <= index < len(self._names):
            raise ParamError(ParamError.DOES_NOT_EXIST)
        return self._names[index]

    def set(self, name: str, value: Value) -> None:
        """Out-of-range values are taken, as PX4 takes them [01_connect]."""
        self._values[name] = float(value) if isinstance(self._values[name], float) else int(value)
        self.version += 1

    def encode(self, name: str) -> tuple[float, int]:
        """`param_value` and `param_type`; an int32 is packed bytewise into the float. Raises ParamError."""
        if name not in self._values:
            raise ParamError(ParamError.DOES_NOT_EXIST)
        value = self._values[name]
        if isinstance(value, float):
            return value, MAV_PARAM_TYPE_REAL32
        return float(struct.unpack("<f", struct.pack("<i", value))[0]), MAV_PARAM_TYPE_INT32

    def decode_and_set(self, name: str, param_value: float, param_type: int) -> None:
        """PARAM_SET. Raises ParamError when the name is unknown or the type is another."""
        expected = self.encode(name)[1]
        if param_type != expected:
            raise ParamError(ParamError.TYPE_MISMATCH)
        if expected == MAV_PARAM_TYPE_REAL32:
            self.set(name, param_value)
        else:
            self.set(name, struct.unpack("<i", struct.pack("<f", param_value))[0])
