"""What differs between the PX4 versions that a simulated vehicle can pretend to be."""

from __future__ import annotations

from dataclasses import dataclass, field

from app.simulator.params import Value


@dataclass(frozen=True, slots=True)
class FirmwareProfile:
    """One version's behaviour, as the navigator and the payload deliverer need it."""

    name: str
    flight_sw_version: int
    """AUTOPILOT_VERSION: major, minor, patch, type (64 alpha, 255 release) from the highest byte down."""
    git_hash: bytes
    gripper_items_wait_for_ack: bool
    """A mission stays at DO_GRIPPER until the gripper is done or MIS_PD_TO is over (up to v1.15)."""
    gripper_items_brake: bool
    """A multicopter stops at the waypoint before a gripper item (up to v1.15)."""
    reports_mission_ids: bool
    """MISSION_ACK.opaque_id, MISSION_CURRENT.mission_id and mission_state exist (0 before)."""
    command_timeout_param: str
    switch_distance_s: float
    """Fixed wing: a waypoint counts as reached this many seconds of ground speed before it."""
    unused_params_must_be_empty: bool
    """Mission items with a value in a parameter their command does not use are refused (since v1.18)."""
    params: dict[str, Value] = field(default_factory=dict)
    """Parameters that only this version has."""


PX4_MAIN = FirmwareProfile(
    name="px4-main",
    flight_sw_version=1 << 24 | 19 << 16 | 0 << 8 | 64,  # as recorded
    git_hash=bytes.fromhex("bb59c637cd000000"),
    gripper_items_wait_for_ack=False,
    gripper_items_brake=False,
    reports_mission_ids=True,
    command_timeout_param="MIS_COMMAND_TOUT",
    switch_distance_s=10.0 * 0.7 * 0.32,  # NPFG_PERIOD x NPFG_DAMPING x NPFG_SW_DST_MLT
    unused_params_must_be_empty=True,
)

PX4_1_14 = FirmwareProfile(
    name="px4-1.14",
    flight_sw_version=1 << 24 | 14 << 16 | 3 << 8 | 255,
    git_hash=bytes.fromhex("1dacb4cdad000000"),
    gripper_items_wait_for_ack=True,
    gripper_items_brake=True,
    reports_mission_ids=False,
    command_timeout_param="MIS_PD_TO",
    switch_distance_s=10.0 * 0.7 * 0.32,
    unused_params_must_be_empty=False,
    params={"MIS_PD_TO": 5.0, "PD_GRIPPER_EN": 1},
)

PROFILES = {profile.name: profile for profile in (PX4_MAIN, PX4_1_14)}
