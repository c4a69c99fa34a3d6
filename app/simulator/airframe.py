"""The kinds of vehicle, and what their airframe file sets."""

from __future__ import annotations

from dataclasses import dataclass, field

from app.simulator.wire import GRIPPER_FUNCTION


@dataclass(frozen=True, slots=True)
class Airframe:
    """A vehicle type as PX4's SITL airframes define it."""

    name: str
    mav_type: int
    """MAV_TYPE of the heartbeat."""
    functions: tuple[int, ...]
    """PWM_MAIN_FUNC1 and on: what its outputs move, the gripper on the first free one."""
    params: dict[str, int | float] = field(default_factory=dict)
    """Parameters that differ from the common defaults."""
    hover_throttle: float = 0.5
    """What keeps a hovering vehicle in the air; a VTOL's lift motors are strong [25_land_detector_vtol]."""

    @property
    def unread(self) -> frozenset[str]:
        """Parameters that nothing looks up as it boots: the controllers of other types do not run, the
        first mission check comes later. As PX4's SIH models answer (param_index 65535).
        """
        if self.is_fixed_wing:  # its own modules and its airframe file look up two of the three
            return _NO_ROTORS | {"MIS_DIST_1WP"}
        if self.is_vtol:
            return _NO_RUNWAY | {"MIS_DIST_1WP"}
        return _NO_WING | _CHECK | (_NO_ROTORS if self.is_rover else frozenset())

    @property
    def is_fixed_wing(self) -> bool:
        """Never hovers."""
        return self.name == "plane"

    @property
    def is_vtol(self) -> bool:
        """Changes between the two."""
        return self.name == "vtol"

    @property
    def is_rover(self) -> bool:
        return self.name == "rover"

    @property
    def is_airship(self) -> bool:
        """Floats, and cannot brake."""
        return self.name == "airship"

    @property
    def has_range_sensor(self) -> bool:
        """SITL's hovering vehicles look down."""
        return self.is_multicopter or self.is_vtol

    @property
    def has_airspeed_sensor(self) -> bool:
        """Has a wing."""
        return self.is_fixed_wing or self.is_vtol

    @property
    def is_multicopter(self) -> bool:
        """Always in rotary-wing state."""
        return self.name in ("quad", "hexa")


_CHECK = frozenset({"FW_LND_ANG", "MIS_DIST_1WP", "MIS_TKO_LAND_REQ"})
"""Looked up by the first mission check."""
_NO_RUNWAY = frozenset(
    {
        "LNDFW_AIRSPD_MAX",
        "LNDFW_ROT_MAX",
        "LNDFW_TRIG_TIME",
        "LNDFW_VEL_XY_MAX",
        "LNDFW_VEL_Z_MAX",
        "LNDFW_XYACC_MAX",
    }
)
_NO_WING = _NO_RUNWAY | frozenset(
    {
        "FW_AIRSPD_MIN",
        "FW_GPSF_LT",
        "FW_GPSF_R",
        "FW_R_LIM",
        "NPFG_DAMPING",
        "NPFG_PERIOD",
        "NPFG_SW_DST_MLT",
        "RWTO_RAMP_TIME",
        "VT_ARSP_TRANS",
    }
)
_NO_ROTORS = frozenset(
    {
        "LNDMC_ALT_GND",
        "LNDMC_ROT_MAX",
        "LNDMC_XY_VEL_MAX",
        "LNDMC_Z_VEL_MAX",
        "MPC_ACC_DOWN_MAX",
        "MPC_ACC_UP_MAX",
        "MPC_LAND_ALT1",
        "MPC_LAND_ALT2",
        "MPC_LAND_SPEED",
        "MPC_MANTHR_MIN",
        "MPC_THR_HOVER",
        "MPC_THR_MIN",
        "MPC_TKO_RAMP_T",
        "MPC_TKO_SPEED",
        "MPC_XY_ERR_MAX",
        "MPC_XY_TRAJ_P",
        "MPC_XY_VEL_MAX",
        "VT_ARSP_TRANS",
    }
)
_PLANE_SPEEDS = {"FW_AIRSPD_TRIM": 12.0, "FW_AIRSPD_MAX": 14.0, "FW_AIRSPD_MIN": 10.0}
_PLANE_HEIGHTS = {"MIS_TAKEOFF_ALT": 25.0, "RTL_RETURN_ALT": 100.0}  # [14_infeasible_plane, 20_offboard_plane]
_VTOL_HOVER = {"MPC_XY_VEL_MAX": 8.0, "MPC_XY_ERR_MAX": 5.0, "MIS_TAKEOFF_ALT": 20.0}  # rc.vtol_defaults
_VTOL_WING = {"MIS_TKO_LAND_REQ": 2, "FW_AIRSPD_TRIM": 10.5}
_PLANE_RETURN = {"RTL_LAND_DELAY": -1.0}  # rc.fw_defaults: it circles until somebody decides

_GRIPPER = GRIPPER_FUNCTION
_FOUR_MOTORS = (101, 102, 103, 104)
_SURFACES = (201, 202, 203)

AIRFRAMES = {
    airframe.name: airframe
    for airframe in (
        Airframe("quad", 2, (*_FOUR_MOTORS, _GRIPPER), {"SYS_AUTOSTART": 10040}),
        Airframe("hexa", 13, (*_FOUR_MOTORS, 105, 106, _GRIPPER), {"SYS_AUTOSTART": 10044}),
        Airframe(
            "plane",
            1,
            (*_SURFACES, 101, _GRIPPER),
            {"SYS_AUTOSTART": 10041, "MIS_TKO_LAND_REQ": 2, **_PLANE_HEIGHTS, **_PLANE_SPEEDS, **_PLANE_RETURN},
        ),
        Airframe(
            "vtol",
            22,
            (*_FOUR_MOTORS, *_SURFACES, 105, _GRIPPER),
            {"SYS_AUTOSTART": 10043, **_VTOL_WING, **_VTOL_HOVER},
            0.3,
        ),
        Airframe(
            "rover", 10, (201, 101, _GRIPPER), {"SYS_AUTOSTART": 10045, "NAV_ACC_RAD": 0.5, "RTL_RETURN_ALT": 60.0}
        ),
        Airframe(
            "airship",
            7,
            (101, 102, 201, 103, _GRIPPER),
            {"SYS_AUTOSTART": 2507, "MPC_XY_CRUISE": 3.0, "MPC_Z_V_AUTO_UP": 1.0},
        ),
    )
}
