"""What goes over the wire for a setpoint: one of three MAVLink messages, complete, in SI units. NaN is "not given"."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, IntFlag
from math import nan

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
