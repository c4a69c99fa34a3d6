"""From a setpoint to the message that is sent. Refuses what the vehicle does not follow."""

from __future__ import annotations

import math
from dataclasses import dataclass
from math import nan

from app.domain.autopilot.capability import FirmwareProfile, FlightKind
from app.domain.errors import SetpointRefusedError
from app.domain.offboard.control_method import Capability, capability
from app.domain.offboard.messages import (
    GLIDE,
    NOT_GIVEN,
    TYPE_BITS,
    AttitudeTarget,
    Estimate,
    GlobalTarget,
    Ignore,
    LocalTarget,
    SetpointFrame,
    SetpointMessage,
    Vector,
)
from app.domain.offboard.setpoints import (
    AccelerationBody,
    Attitude,
    BodyRates,
    GlobalPlace,
    Heading,
    NedAcceleration,
    NedPlace,
    NedVelocity,
    Setpoint,
    TypedPositionNed,
    VelocityBody,
)


@dataclass(frozen=True, slots=True)
class Follower:
    """The vehicle as far as a setpoint needs it. `home_altitude_m` is AMSL; `has_estimate`: it knows where it is."""

    kind: FlightKind
    profile: FirmwareProfile
    home_altitude_m: float | None = None
    has_estimate: bool = True


def encode(setpoint: Setpoint, follower: Follower) -> SetpointMessage:
    """Return the message of a setpoint.

    Raises:
        SetpointRefusedError: with code and reason of the capability table, or naming the missing fact.
    """
    known = refuse_unfit(setpoint, follower)
    if isinstance(setpoint, Attitude):
        return AttitudeTarget(known.wire.type_mask, setpoint.thrust, q=quaternion(setpoint))
    if isinstance(setpoint, BodyRates):
        rates = (setpoint.roll_deg_s, setpoint.pitch_deg_s, setpoint.yaw_deg_s)
        return AttitudeTarget(known.wire.type_mask, setpoint.thrust, rates_rad_s=_radians(rates))
    if isinstance(setpoint, GlobalPlace) or known.wire.frame is SetpointFrame.GLOBAL_INT:
        return _global(setpoint, known, follower)
    return _local(setpoint, known)


def quaternion(attitude: Attitude) -> tuple[float, float, float, float]:
    """w, x, y, z of roll, pitch and yaw."""
    roll, pitch, yaw = (math.radians(a) / 2 for a in (attitude.roll_deg, attitude.pitch_deg, attitude.yaw_deg))
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def type_mask_of(setpoint: Setpoint, known: Capability) -> int:
    """The mask of this very setpoint: the form's, with the heading's bits and the documented types."""
    mask = known.wire.type_mask
    setpoint_type = getattr(setpoint, "setpoint_type", None)
    if setpoint_type is not None:
        return GLIDE if setpoint_type == "glide" else mask | TYPE_BITS[setpoint_type]
    if isinstance(setpoint, Heading):
        mask &= ~int(Ignore.YAW) if setpoint.yaw_deg is not None else ~0
        mask &= ~int(Ignore.YAW_RATE) if setpoint.yawspeed_deg_s is not None else ~0
    return mask


def refuse_unfit(setpoint: Setpoint, follower: Follower) -> Capability:
    """How the vehicle takes this form. Raises SetpointRefusedError as `encode` does."""
    known = capability(setpoint.type, follower.kind, follower.profile)
    if not known.support.is_accepted:
        detail = f"{setpoint.type} is not sent to a {follower.kind.value}: {known.support.reason}"
        raise SetpointRefusedError(refusal=known.support.code, detail=detail, form=setpoint.type)
    if known.wire.estimate is not Estimate.NONE and not follower.has_estimate:
        raise SetpointRefusedError(
            refusal="setpoint.no_estimate",
            detail=f"{setpoint.type} needs a {known.wire.estimate.value} estimate, and no fresh position is reported",
            form=setpoint.type,
        )
    if isinstance(setpoint, NedPlace) and setpoint.down_m is None and follower.kind is not FlightKind.ROVER:
        raise SetpointRefusedError(
            refusal="setpoint.height_needed", detail="PX4 needs all three coordinates: give down_m", form=setpoint.type
        )
    if isinstance(setpoint, GlobalPlace):
        amsl_of(setpoint, follower)
    return known


def _local(setpoint: Setpoint, known: Capability) -> LocalTarget:
    position, velocity, acceleration = NOT_GIVEN, NOT_GIVEN, NOT_GIVEN
    if isinstance(setpoint, NedPlace):
        position = (setpoint.north_m, setpoint.east_m, 0.0 if setpoint.down_m is None else setpoint.down_m)
    if isinstance(setpoint, NedVelocity):
        velocity = (setpoint.north_m_s, setpoint.east_m_s, setpoint.down_m_s)
    if isinstance(setpoint, NedAcceleration):
        acceleration = (setpoint.north_m_s2, setpoint.east_m_s2, setpoint.down_m_s2)
    if isinstance(setpoint, VelocityBody):
        velocity = (setpoint.forward_m_s, setpoint.right_m_s, setpoint.down_m_s)
    if isinstance(setpoint, AccelerationBody):
        acceleration = (setpoint.forward_m_s2, setpoint.right_m_s2, setpoint.down_m_s2)
    if isinstance(setpoint, TypedPositionNed):
        velocity = acceleration = (0.0, 0.0, 0.0)
    frame = SetpointFrame.LOCAL_NED if known.wire.frame is None else known.wire.frame
    yaw, rate = _heading(setpoint)
    return LocalTarget(frame, type_mask_of(setpoint, known), position, velocity, acceleration, yaw, rate)


def _global(setpoint: Setpoint, known: Capability, follower: Follower) -> GlobalTarget:
    """Altitudes go out as AMSL: PX4's reading of the relative frame is doubtful, and of the terrain one none."""
    yaw, rate = _heading(setpoint)
    velocity = NOT_GIVEN
    if isinstance(setpoint, NedVelocity):
        velocity = (setpoint.north_m_s, setpoint.east_m_s, setpoint.down_m_s)
    mask = type_mask_of(setpoint, known)
    if not isinstance(setpoint, GlobalPlace):
        return GlobalTarget(SetpointFrame.GLOBAL_INT, mask, velocity=velocity, yaw_rad=yaw, yaw_rate_rad_s=rate)
    altitude_m = amsl_of(setpoint, follower)
    place = (setpoint.latitude_deg, setpoint.longitude_deg, altitude_m)
    return GlobalTarget(SetpointFrame.GLOBAL_INT, mask, *place, velocity, yaw, rate)


def amsl_of(place: GlobalPlace, follower: Follower) -> float:
    """The altitude above mean sea level. Raises SetpointRefusedError where it is not known."""
    if place.altitude_type == "amsl":
        return place.altitude_m
    if place.altitude_type == "agl":
        raise SetpointRefusedError(
            refusal="setpoint.frame_unsupported",
            detail="PX4 drops terrain altitudes without a word",
            hint="use amsl or rel_home",
        )
    if follower.home_altitude_m is None:
        raise SetpointRefusedError(
            refusal="setpoint.home_unknown",
            detail="the vehicle's home is not known, so rel_home has no meaning",
            hint="use amsl",
        )
    return follower.home_altitude_m + place.altitude_m


def _heading(setpoint: Setpoint) -> tuple[float, float]:
    if not isinstance(setpoint, Heading):
        return nan, nan
    yaw = nan if setpoint.yaw_deg is None else math.radians((setpoint.yaw_deg + 180.0) % 360.0 - 180.0)
    rate = nan if setpoint.yawspeed_deg_s is None else math.radians(setpoint.yawspeed_deg_s)
    return yaw, rate


def _radians(degrees: Vector) -> Vector:
    x, y, z = degrees
    return math.radians(x), math.radians(y), math.radians(z)
