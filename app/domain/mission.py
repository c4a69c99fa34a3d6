"""The mission: what a vehicle gets. A frozen list of MISSION_ITEM_INT, compiled from a plan."""

from __future__ import annotations

import hashlib
import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Final

_PACKED: Final = struct.Struct("<BHBffffiif")
NAN = math.nan
"""On the wire "not given" is NaN and never 0: in DO_GRIPPER a 0 means RELEASE."""


class MavFrame(IntEnum):
    """MAV_FRAME values that PX4 accepts in missions."""

    GLOBAL = 0
    MISSION = 2
    GLOBAL_RELATIVE_ALT = 3
    GLOBAL_INT = 5
    GLOBAL_RELATIVE_ALT_INT = 6


class MissionType(IntEnum):
    """MAV_MISSION_TYPE: the three lists of the mission protocol."""

    MISSION = 0
    FENCE = 1
    RALLY = 2


class MavCmd(IntEnum):
    """MAV_CMD values that Waydrop sends, in missions or as commands, and those that the missions of others have."""

    NAV_WAYPOINT = 16
    NAV_LOITER_UNLIM = 17
    NAV_LOITER_TURNS = 18
    NAV_LOITER_TIME = 19
    NAV_RETURN_TO_LAUNCH = 20
    NAV_LAND = 21
    NAV_TAKEOFF = 22
    NAV_LOITER_TO_ALT = 31
    DO_ORBIT = 34
    NAV_ROI = 80
    NAV_PATHPLANNING = 81
    NAV_SPLINE_WAYPOINT = 82
    NAV_VTOL_TAKEOFF = 84
    NAV_VTOL_LAND = 85
    NAV_GUIDED_ENABLE = 92
    NAV_DELAY = 93
    NAV_PAYLOAD_PLACE = 94
    NAV_LAST = 95
    CONDITION_DELAY = 112
    CONDITION_CHANGE_ALT = 113
    CONDITION_DISTANCE = 114
    CONDITION_YAW = 115
    DO_SET_MODE = 176
    DO_JUMP = 177
    DO_CHANGE_SPEED = 178
    DO_SET_HOME = 179
    DO_SET_RELAY = 181
    DO_REPEAT_RELAY = 182
    DO_SET_SERVO = 183
    DO_REPEAT_SERVO = 184
    DO_SET_ACTUATOR = 187
    DO_LAND_START = 189
    DO_GO_AROUND = 191
    DO_REPOSITION = 192
    DO_SET_ROI_LOCATION = 195
    DO_SET_ROI_WPNEXT_OFFSET = 196
    DO_SET_ROI_NONE = 197
    DO_SET_ROI_SYSID = 198
    DO_SET_ROI = 201
    DO_DIGICAM_CONFIGURE = 202
    DO_DIGICAM_CONTROL = 203
    DO_MOUNT_CONFIGURE = 204
    DO_MOUNT_CONTROL = 205
    DO_SET_CAM_TRIGG_DIST = 206
    DO_FENCE_ENABLE = 207
    DO_PARACHUTE = 208
    DO_INVERTED_FLIGHT = 210
    DO_GRIPPER = 211
    DO_AUTOTUNE_ENABLE = 212
    NAV_SET_YAW_SPEED = 213
    DO_SET_CAM_TRIGG_INTERVAL = 214
    DO_AUX_FUNCTION = 218
    DO_GUIDED_LIMITS = 222
    DO_ENGINE_CONTROL = 223
    DO_SET_MISSION_CURRENT = 224
    OBLIQUE_SURVEY = 260
    MISSION_START = 300
    COMPONENT_ARM_DISARM = 400
    SET_MESSAGE_INTERVAL = 511
    REQUEST_MESSAGE = 512
    SET_CAMERA_MODE = 530
    SET_CAMERA_ZOOM = 531
    SET_CAMERA_FOCUS = 532
    SET_CAMERA_SOURCE = 534
    DO_GIMBAL_MANAGER_PITCHYAW = 1000
    DO_GIMBAL_MANAGER_CONFIGURE = 1001
    IMAGE_START_CAPTURE = 2000
    IMAGE_STOP_CAPTURE = 2001
    DO_TRIGGER_CONTROL = 2003
    VIDEO_START_CAPTURE = 2500
    VIDEO_STOP_CAPTURE = 2501
    DO_VTOL_TRANSITION = 3000
    CONDITION_GATE = 4501
    NAV_FENCE_RETURN_POINT = 5000
    NAV_FENCE_POLYGON_VERTEX_INCLUSION = 5001
    NAV_FENCE_POLYGON_VERTEX_EXCLUSION = 5002
    NAV_FENCE_CIRCLE_INCLUSION = 5003
    NAV_FENCE_CIRCLE_EXCLUSION = 5004
    NAV_RALLY_POINT = 5100
    PAYLOAD_PREPARE_DEPLOY = 30001
    PAYLOAD_CONTROL_DEPLOY = 30002
    DO_WINCH = 42600


@dataclass(frozen=True, slots=True)
class MissionItem:
    """One MISSION_ITEM_INT. `x`, `y` are latitude and longitude in 1e7 degrees; `z` is metres."""

    seq: int
    frame: MavFrame
    command: MavCmd
    param1: float = NAN
    param2: float = NAN
    param3: float = NAN
    param4: float = NAN
    x: int = 0
    y: int = 0
    z: float = 0.0
    current: bool = False
    autocontinue: bool = True
    mission_type: MissionType = MissionType.MISSION

    def same_as(self, other: MissionItem) -> bool:
        """Equal as PX4 stores it: floats at single precision, NaN equal to NaN, `current` ignored."""
        floats = zip(
            (self.param1, self.param2, self.param3, self.param4, self.z),
            (other.param1, other.param2, other.param3, other.param4, other.z),
            strict=True,
        )
        return (
            (self.seq, self.frame, self.command, self.x, self.y, self.autocontinue, self.mission_type)
            == (other.seq, other.frame, other.command, other.x, other.y, other.autocontinue, other.mission_type)
        ) and all(_same_float(a, b) for a, b in floats)


def _same_float(a: float, b: float) -> bool:
    if math.isnan(a) or math.isnan(b):
        return math.isnan(a) and math.isnan(b)
    return math.isclose(a, b, rel_tol=1e-6, abs_tol=1e-6)


@dataclass(frozen=True, slots=True)
class Mission:
    """A compiled plan. `plan_item_of` maps each seq to the id of the plan item that it came from."""

    items: tuple[MissionItem, ...]
    fence: tuple[MissionItem, ...] = ()
    rally: tuple[MissionItem, ...] = ()
    plan_item_of: Mapping[int, str] = field(default_factory=dict)
    drops: tuple[CompiledDrop, ...] = ()

    @property
    def detours(self) -> tuple[range, ...]:
        """The items of the detour over the alternates. A vehicle flies them only when one is made current by a
        command.
        """
        return tuple([range(d.alternate_seq, d.resume_seq) for d in self.drops if d.alternate_seq is not None])

    def seqs_of(self, plan_item_id: str) -> tuple[int, ...]:
        """All sequence numbers that one plan item became, in order; empty if it became none."""
        return tuple(seq for seq, item in sorted(self.plan_item_of.items()) if item == plan_item_id)

    def is_return(self, seq: int) -> bool:
        """Whether this is the return to launch. PX4 says that it is reached when it begins, not at home."""
        return seq < len(self.items) and self.items[seq].command is MavCmd.NAV_RETURN_TO_LAUNCH

    @property
    def ends_with_return(self) -> bool:
        """Whether its last item is the return to launch."""
        return bool(self.items) and self.is_return(len(self.items) - 1)

    @property
    def last_place_seq(self) -> int:
        """The last item with a place; 0 if none has one."""
        places = (item.seq for item in reversed(self.items) if item.frame is not MavFrame.MISSION)
        return next(places, 0)

    @property
    def ends_with_landing(self) -> bool:
        """Whether its last item is a landing at a place."""
        return bool(self.items) and self.items[-1].command in LANDINGS


LANDINGS: Final = frozenset({MavCmd.NAV_LAND, MavCmd.NAV_VTOL_LAND})


def mission_hash(mission: Mission) -> str:
    """SHA-256 (hex) of mission, fence and rally points, each item packed as the fields of MISSION_ITEM_INT,
    little-endian.

    The same lists have the same hash on every machine. PX4's own CRC-32 (`mission_id`) covers the mission only.
    """
    digest = hashlib.sha256()
    for items in (mission.items, mission.fence, mission.rally):
        digest.update(struct.pack("<H", len(items)))
        for item in items:
            floats = (item.param1, item.param2, item.param3, item.param4)
            plain = (NAN if math.isnan(value) else value for value in floats)
            digest.update(_PACKED.pack(item.frame, item.command, item.autocontinue, *plain, item.x, item.y, item.z))
    return digest.hexdigest()


@dataclass(frozen=True, slots=True)
class CompiledDrop:
    """The location of a drop in the mission.

    `hold_seqs` are the items at which the vehicle waits (or passes) for the drop: the position item and, if the type
    needs it, the NAV_DELAY after it. `release_seq` is the DO_GRIPPER or DO_WINCH item of an embedded drop (None if
    supervised: Waydrop sends the command). `resume_seq` is the item made current after a supervised drop; it is never a
    release. `hold_s` bounds the supervised wait, which ends without a command if the link dies. `consent_timeout_s`
    None: an operator has as long as the hold allows. `alternate` is the drop at the second position, and
    `alternate_seq` the item made current to go there; the vehicle then holds for `leave_s` longer than `hold_s`.
    `relative_altitude_m` (above home) or `absolute_altitude_m` (AMSL) is where it hovers; both None on the ground, on
    wheels and on the move.
    """

    plan_item_id: str
    supervised: bool
    stopped: bool
    hold_seqs: tuple[int, ...]
    resume_seq: int
    release_seq: int | None
    command: MavCmd
    params: tuple[float, ...]
    latitude_deg: float
    longitude_deg: float
    hold_s: float
    acceptance_radius_m: float
    relative_altitude_m: float | None = None
    absolute_altitude_m: float | None = None
    landed: bool = False
    needs_consent: bool = False
    consent_timeout_s: float | None = None
    alternate: CompiledDrop | None = None
    alternate_seq: int | None = None
    leave_s: float = 0.0
