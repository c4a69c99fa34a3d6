"""The parameters of one vehicle: PX4's names, types and defaults, and the PARAM messages' packing.

PX4 knows which of them a module has looked up since it booted (param_used). Only those have a param_index, count, are
listed, announced and covered by the hash [28_param_changed, 28b_param_hash].
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Collection, Iterable, Iterator, Mapping

Value = int | float

MAV_PARAM_TYPE_UINT32 = 5
MAV_PARAM_TYPE_INT32 = 6
MAV_PARAM_TYPE_REAL32 = 9
FLT_EPSILON = 1.1920929e-07

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
    READ_ONLY = 5
    TYPE_MISMATCH = 7

    def __init__(self, code: int) -> None:
        super().__init__(f"PARAM_ERROR {code}")
        self.code = code


class Params:
    """Name to value; the type of a default is the type for good, as in the autopilot.

    `unread` are those that no module of this vehicle looks up as it boots; `look_up` is a module that does so later.
    """

    NO_INDEX = 65535
    """`param_index` of a parameter that has not been looked up."""

    def __init__(
        self,
        *overrides: Mapping[str, Value],
        absent: Collection[str] = (),
        unread: Collection[str] = (),
        unsaved: Collection[str] = (),
    ) -> None:
        self._values: dict[str, Value] = {name: value for name, value in DEFAULTS.items() if name not in absent}
        for layer in overrides:
            for name, value in layer.items():
                known = self._values.get(name, value)
                self._values[name] = float(value) if isinstance(known, float) else int(value)
        self._at_boot = frozenset(self._values) - frozenset(unread)
        self._used: list[str] = []
        self.version = 0
        """Counts the changes: what is derived from parameters in every cycle is derived once."""
        self.unsaved = {name for name in unsaved if name in self._values}
        """Changed, and not on the storage yet: they are announced at each change of any parameter."""
        self.boot()

    def boot(self) -> None:
        """Nothing has been looked up but what every start looks up."""
        self._used = sorted(self._at_boot)

    def look_up(self, names: Iterable[str]) -> None:
        """A module reads them for the first time: they are used from now on."""
        new = {name for name in names if name in self._values} - set(self._used)
        if new:
            self._used = sorted((*self._used, *new))

    def __getitem__(self, name: str) -> Value:
        return self._values[name]

    def __contains__(self, name: str) -> bool:
        return name in self._values

    def __iter__(self) -> Iterator[str]:
        """Those that are used."""
        return iter(tuple(self._used))

    def __len__(self) -> int:
        """`param_count` of PARAM_VALUE."""
        return len(self._used)

    def integer(self, name: str) -> int:
        """An int32 parameter's value."""
        return int(self._values[name])

    def index_of(self, name: str) -> int:
        """`param_index` of PARAM_VALUE."""
        return self._used.index(name) if name in self._used else self.NO_INDEX

    def name_at(self, index: int) -> str:
        """The parameter with this `param_index`. Raises ParamError."""
        if not 0 <= index < len(self._used):
            raise ParamError(ParamError.DOES_NOT_EXIST)
        return self._used[index]

    def set(self, name: str, value: Value) -> None:
        """Out-of-range values are taken, as PX4 takes them [01_connect]. The same value again is no change."""
        old = self._values[name]
        self._values[name] = float(value) if isinstance(old, float) else int(value)
        if abs(self._values[name] - old) > (FLT_EPSILON if isinstance(old, float) else 0):
            self.unsaved.add(name)
            self.version += 1
        else:
            self.unsaved.discard(name)  # as param_set does

    def to_announce(self) -> list[str]:
        """Those that a change makes PX4 announce: used, and not saved yet."""
        return [name for name in self._used if name in self.unsaved]

    def checksum(self) -> int:
        """`_HASH_CHECK`: names and values of those that are used, as param_hash_check computes it."""
        crc = 0xFFFFFFFF  # PX4's crc32part neither inverts at its beginning nor at its end
        for name in self._used:
            value = self._values[name]
            data = struct.pack("<f" if isinstance(value, float) else "<i", value)
            crc = zlib.crc32(name.encode() + data, crc)
        return crc ^ 0xFFFFFFFF

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
