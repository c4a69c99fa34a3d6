"""How each form looks on the wire: message, frame, type mask, and which estimate the vehicle needs to follow it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum, IntFlag, StrEnum
from math import nan
from typing import Final

Vector = tuple[float, float, float]
NOT_GIVEN: Vector = (nan, nan, nan)


class SetpointFrame(IntEnum):
    """MAV_FRAME values of the setpoint messages. PX4 takes LOCAL_NED, BODY_NED and the global ones but terrain."""

    LOCAL_NED = 1
    GLOBAL_INT = 5
    GLOBAL_RELATIVE_ALT_INT = 6
    LOCAL_OFFSET_NED = 7
    BODY_NED = 8
    GLOBAL_TERRAIN_ALT_INT = 11


class Ignore(IntFlag):
    """POSITION_TARGET_TYPEMASK: what the vehicle must not look at."""

    POSITION = 0x007
    VELOCITY = 0x038
    ACCELERATION = 0x1C0
    YAW = 0x400
    YAW_RATE = 0x800


@dataclass(frozen=True, slots=True)
class LocalTarget:
    """SET_POSITION_TARGET_LOCAL_NED: metres, m/s, m/s2, radians; north, east, down (or forward, right, down)."""

    frame: SetpointFrame
    type_mask: int
    position: Vector = NOT_GIVEN
    velocity: Vector = NOT_GIVEN
    acceleration: Vector = NOT_GIVEN
    yaw_rad: float = nan
    yaw_rate_rad_s: float = nan

    name = "SET_POSITION_TARGET_LOCAL_NED"


@dataclass(frozen=True, slots=True)
class GlobalTarget:
    """SET_POSITION_TARGET_GLOBAL_INT: `altitude_m` by the frame, velocity north, east, down."""

    frame: SetpointFrame
    type_mask: int
    latitude_deg: float = 0.0
    longitude_deg: float = 0.0
    altitude_m: float = nan
    velocity: Vector = NOT_GIVEN
    yaw_rad: float = nan
    yaw_rate_rad_s: float = nan

    name = "SET_POSITION_TARGET_GLOBAL_INT"


@dataclass(frozen=True, slots=True)
class AttitudeTarget:
    """SET_ATTITUDE_TARGET: quaternion w, x, y, z; body rates in rad/s; thrust 0 to 1."""

    type_mask: int
    thrust: float
    q: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    rates_rad_s: Vector = (0.0, 0.0, 0.0)

    name = "SET_ATTITUDE_TARGET"


SetpointMessage = LocalTarget | GlobalTarget | AttitudeTarget


class Estimate(StrEnum):
    """The estimate that the vehicle needs."""

    POSITION = "position"
    VELOCITY = "velocity"
    NONE = "none"


@dataclass(frozen=True, slots=True)
class WireForm:
    """`type_mask` is without a heading; a given yaw or yaw rate clears its bit. `frame` None: attitude."""

    message: str
    frame: SetpointFrame | None
    type_mask: int
    estimate: Estimate


_LOCAL: Final = LocalTarget.name
_GLOBAL: Final = GlobalTarget.name
_ATTITUDE: Final = AttitudeTarget.name
_F = SetpointFrame
_E = Estimate
_HEADING: Final = int(Ignore.YAW | Ignore.YAW_RATE)
POSITION: Final = int(Ignore.VELOCITY | Ignore.ACCELERATION) | _HEADING
VELOCITY: Final = int(Ignore.POSITION | Ignore.ACCELERATION) | _HEADING
ACCELERATION: Final = int(Ignore.POSITION | Ignore.VELOCITY) | _HEADING
POSITION_VELOCITY: Final = int(Ignore.ACCELERATION) | _HEADING
ATTITUDE: Final = 7
RATES: Final = 128

TYPE_BITS: Final[Mapping[str, int]] = {"takeoff": 4096, "land": 8192, "loiter": 12288, "idle": 16384}
"""PX4's own, not MAVLink's: documented, and no longer decoded by current firmware."""
GLIDE: Final = 292
"""Not bits but this very value: Z, VZ and AZ ignored."""

WIRE_FORMS: Final[Mapping[str, WireForm]] = {
    "position_ned": WireForm(_LOCAL, _F.LOCAL_NED, POSITION, _E.POSITION),
    "velocity_ned": WireForm(_LOCAL, _F.LOCAL_NED, VELOCITY, _E.VELOCITY),
    "acceleration_ned": WireForm(_LOCAL, _F.LOCAL_NED, ACCELERATION, _E.VELOCITY),
    "position_velocity_ned": WireForm(_LOCAL, _F.LOCAL_NED, POSITION_VELOCITY, _E.POSITION),
    "position_velocity_acceleration_ned": WireForm(_LOCAL, _F.LOCAL_NED, _HEADING, _E.POSITION),
    "velocity_body": WireForm(_LOCAL, _F.BODY_NED, VELOCITY, _E.VELOCITY),
    "acceleration_body": WireForm(_LOCAL, _F.BODY_NED, ACCELERATION, _E.VELOCITY),
    "position_body": WireForm(_LOCAL, _F.BODY_NED, POSITION, _E.POSITION),
    "position_offset_ned": WireForm(_LOCAL, _F.LOCAL_OFFSET_NED, POSITION, _E.POSITION),
    "position_global": WireForm(_GLOBAL, _F.GLOBAL_INT, POSITION, _E.POSITION),
    "velocity_global": WireForm(_GLOBAL, _F.GLOBAL_INT, VELOCITY, _E.VELOCITY),
    "position_velocity_global": WireForm(_GLOBAL, _F.GLOBAL_INT, POSITION_VELOCITY, _E.POSITION),
    "acceleration_global": WireForm(_GLOBAL, _F.GLOBAL_INT, ACCELERATION, _E.VELOCITY),
    "attitude": WireForm(_ATTITUDE, None, ATTITUDE, _E.NONE),
    "body_rates": WireForm(_ATTITUDE, None, RATES, _E.NONE),
    "typed_position_ned": WireForm(_LOCAL, _F.LOCAL_NED, POSITION, _E.POSITION),
    "typed_position_global": WireForm(_GLOBAL, _F.GLOBAL_INT, POSITION, _E.POSITION),
    "thrust_torque": WireForm("none", None, 0, _E.NONE),
    "actuators": WireForm("none", None, 0, _E.NONE),
}
