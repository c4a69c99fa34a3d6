"""What differs between the PX4 versions that a simulated vehicle can pretend to be."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from app.simulator.params import Params, Value


@dataclass(frozen=True, slots=True)
class FirmwareProfile:
    """One version's behaviour, as the navigator and the payload deliverer need it."""

    name: str
    flight_sw_version: int
    """AUTOPILOT_VERSION: major, minor, patch, type (64 alpha, 255 release) from the highest byte down."""
    git_hash: bytes
    delivers_payload: bool
    """There is a payload deliverer, and missions take DO_GRIPPER and DO_WINCH (since v1.14)."""
    gripper_items_wait_for_ack: bool
    """A mission stays at DO_GRIPPER until its ack ACCEPTED has come or MIS_PD_TO is over (up to v1.15)."""
    gripper_items_brake: bool
    """A multicopter stops at the waypoint before a gripper item (up to v1.15)."""
    reports_mission_ids: bool
    """MISSION_ACK.opaque_id, MISSION_CURRENT.mission_id and mission_state exist (0 before)."""
    reports_param_errors: bool
    """PARAM_ERROR answers what cannot be read or set; before, nothing does."""
    unused_params_must_be_empty: bool
    """Mission items with a value in a parameter their command does not use are refused (since v1.18)."""
    signs: bool
    """MAVLink 2 signing (since v1.18): SETUP_SIGNING sets a key."""
    names_fence_limit: bool
    """A breached fence's text says which limit was exceeded (since v1.15)."""
    needs_all_inclusions: bool
    """A position has to be in all inclusions that contain home (since v1.15), before in any."""
    reports_current_mode: bool
    """CURRENT_MODE, with the intended mode (since v1.15)."""
    shows_descend: bool
    """Descend has a sub mode of its own, 20 (PR 27918, July 2026); before, it shows as Land."""
    judges_start: bool
    """A first waypoint beyond MIS_DIST_1WP, and a takeoff that is not 1 m above NAV_ACC_RAD, are infeasible (up to
    v1.15). Since then the one is warned of, and the other has to be above home.
    """
    returns_round_fence: bool
    """A direct return is planned round the fence (since v1.19)."""
    command_timeout_param: str
    guidance_params: tuple[str, ...]
    guidance_factor: float
    params: dict[str, Value] = field(default_factory=dict)
    """Parameters that this version has and the newest has not."""
    absent: tuple[str, ...] = ()
    """Parameters of the newest that this version has not."""

    def switch_distance_s(self, params: Params) -> float:
        """Fixed wing: a waypoint counts as reached this many seconds of ground speed before it."""
        return self.guidance_factor * math.prod(float(params[name]) for name in self.guidance_params)


NPFG = ("NPFG_PERIOD", "NPFG_DAMPING", "NPFG_SW_DST_MLT")
"""Guidance since v1.14. 2.24 s with the defaults."""
L1 = ("FW_L1_PERIOD", "FW_L1_DAMPING")
"""Guidance before; the factor is 1 / pi. 4.77 s with the defaults."""
PAYLOAD = ("PD_GRIPPER_TYPE", "PD_GRIPPER_TO")


PX4_MAIN = FirmwareProfile(
    name="px4-main",
    flight_sw_version=1 << 24 | 19 << 16 | 0 << 8 | 64,  # as recorded
    git_hash=bytes.fromhex("bb59c637cd000000"),
    delivers_payload=True,
    gripper_items_wait_for_ack=False,
    gripper_items_brake=False,
    reports_mission_ids=True,
    reports_param_errors=True,
    unused_params_must_be_empty=True,
    signs=True,
    names_fence_limit=True,
    needs_all_inclusions=True,
    judges_start=False,
    reports_current_mode=True,
    shows_descend=True,
    returns_round_fence=True,
    command_timeout_param="MIS_COMMAND_TOUT",
    guidance_params=NPFG,
    guidance_factor=1.0,
)

PX4_1_14 = replace(
    PX4_MAIN,
    name="px4-1.14",
    flight_sw_version=1 << 24 | 14 << 16 | 3 << 8 | 255,
    git_hash=bytes.fromhex("1dacb4cdad000000"),
    gripper_items_wait_for_ack=True,
    gripper_items_brake=True,
    reports_mission_ids=False,
    reports_param_errors=False,
    unused_params_must_be_empty=False,
    signs=False,
    names_fence_limit=False,
    needs_all_inclusions=False,
    judges_start=True,
    reports_current_mode=False,
    shows_descend=False,
    returns_round_fence=False,
    command_timeout_param="MIS_PD_TO",
    params={"MIS_PD_TO": 5.0, "PD_GRIPPER_EN": 1},
    absent=("MIS_COMMAND_TOUT",),
)

PX4_1_13 = replace(
    PX4_1_14,
    name="px4-1.13",
    flight_sw_version=1 << 24 | 13 << 16 | 3 << 8 | 255,
    git_hash=bytes.fromhex("1c8ab2a0d7000000"),
    delivers_payload=False,
    gripper_items_wait_for_ack=False,
    gripper_items_brake=False,
    guidance_params=L1,
    guidance_factor=1.0 / math.pi,
    params={"FW_L1_PERIOD": 20.0, "FW_L1_DAMPING": 0.75},
    absent=("MIS_COMMAND_TOUT", *NPFG, *PAYLOAD),
)

PROFILES = {profile.name: profile for profile in (PX4_MAIN, PX4_1_14, PX4_1_13)}
