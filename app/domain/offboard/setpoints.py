"""The setpoint forms: what a client requests from a vehicle, in common units. `null` is "not given", never 0."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.domain.items.fields import LatitudeDeg, LongitudeDeg, YawDeg

MOST_METRES: Final = 100_000
Metres = Annotated[float, Field(ge=-MOST_METRES, le=MOST_METRES, allow_inf_nan=False)]
MetresPerSecond = Annotated[float, Field(ge=-200, le=200, allow_inf_nan=False)]
MetresPerSecond2 = Annotated[float, Field(ge=-100, le=100, allow_inf_nan=False)]
DegreesPerSecond = Annotated[float, Field(ge=-2000, le=2000, allow_inf_nan=False)]
Thrust = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False, description="0 none, 1 full")]
AltitudeM = Annotated[float, Field(ge=-1000, le=20_000, allow_inf_nan=False)]
AltitudeType = Literal["amsl", "rel_home", "agl"]
SetpointType = Literal["glide", "takeoff", "land", "loiter", "idle"]


class SetpointModel(BaseModel):
    """Strict, frozen, no unknown fields."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Heading(SetpointModel):
    """Where the nose points; without it the vehicle chooses."""

    yaw_deg: YawDeg | None = None
    yawspeed_deg_s: DegreesPerSecond | None = None


class NedPlace(SetpointModel):
    """A place from the EKF origin (not from home). Only a rover may leave `down_m` out."""

    north_m: Metres
    east_m: Metres
    down_m: Metres | None = None


class GlobalPlace(SetpointModel):
    """A place on earth. `rel_home` is turned into AMSL by the vehicle's home; `agl` no PX4 takes."""

    latitude_deg: LatitudeDeg
    longitude_deg: LongitudeDeg
    altitude_m: AltitudeM
    altitude_type: AltitudeType = "amsl"


class NedVelocity(SetpointModel):
    """A velocity over ground."""

    north_m_s: MetresPerSecond
    east_m_s: MetresPerSecond
    down_m_s: MetresPerSecond = 0.0


class NedAcceleration(SetpointModel):
    """An acceleration."""

    north_m_s2: MetresPerSecond2
    east_m_s2: MetresPerSecond2
    down_m_s2: MetresPerSecond2 = 0.0


class PositionNed(NedPlace, Heading):
    """Go to a place and stay."""

    type: Literal["position_ned"]


class VelocityNed(NedVelocity, Heading):
    """Fly with a velocity."""

    type: Literal["velocity_ned"]


class AccelerationNed(NedAcceleration, Heading):
    """Accelerate."""

    type: Literal["acceleration_ned"]


class PositionVelocityNed(NedPlace, NedVelocity, Heading):
    """A place with a velocity as feed-forward; on a fixed wing a point of the path and its tangent."""

    type: Literal["position_velocity_ned"]


class PositionVelocityAccelerationNed(NedPlace, NedVelocity, NedAcceleration, Heading):
    """A place with velocity and acceleration as feed-forward."""

    type: Literal["position_velocity_acceleration_ned"]


class VelocityBody(Heading):
    """Fly with a velocity as seen from the vehicle, turned by its heading alone."""

    type: Literal["velocity_body"]
    forward_m_s: MetresPerSecond
    right_m_s: MetresPerSecond = 0.0
    down_m_s: MetresPerSecond = 0.0


class AccelerationBody(Heading):
    """Accelerate as seen from the vehicle, turned by its whole attitude."""

    type: Literal["acceleration_body"]
    forward_m_s2: MetresPerSecond2
    right_m_s2: MetresPerSecond2 = 0.0
    down_m_s2: MetresPerSecond2 = 0.0


class PositionBody(Heading):
    """A position relative to the vehicle."""

    type: Literal["position_body"]
    forward_m: Metres
    right_m: Metres = 0.0
    down_m: Metres = 0.0


class PositionOffsetNed(NedPlace, Heading):
    """A place counted from where the vehicle is (MAV_FRAME_LOCAL_OFFSET_NED)."""

    type: Literal["position_offset_ned"]


class PositionGlobal(GlobalPlace, Heading):
    """Go to a place on earth and stay."""

    type: Literal["position_global"]


class VelocityGlobal(NedVelocity, Heading):
    """A velocity in the global message."""

    type: Literal["velocity_global"]


class PositionVelocityGlobal(GlobalPlace, NedVelocity, Heading):
    """A place on earth with a velocity as feed-forward."""

    type: Literal["position_velocity_global"]


class AccelerationGlobal(NedAcceleration, Heading):
    """An acceleration in the global message, which PX4 takes for a thrust."""

    type: Literal["acceleration_global"]


class Attitude(SetpointModel):
    """An attitude (yaw, then pitch, then roll, from north) and a thrust."""

    type: Literal["attitude"]
    roll_deg: Annotated[float, Field(ge=-180, le=180, allow_inf_nan=False)] = 0.0
    pitch_deg: Annotated[float, Field(ge=-90, le=90, allow_inf_nan=False)] = 0.0
    yaw_deg: YawDeg
    thrust: Thrust


class BodyRates(SetpointModel):
    """Turning rates about the vehicle's own axes, and a thrust."""

    type: Literal["body_rates"]
    roll_deg_s: DegreesPerSecond = 0.0
    pitch_deg_s: DegreesPerSecond = 0.0
    yaw_deg_s: DegreesPerSecond = 0.0
    thrust: Thrust


class TypedPositionNed(NedPlace):
    """A place with one of PX4's documented setpoint types."""

    type: Literal["typed_position_ned"]
    setpoint_type: SetpointType


class TypedPositionGlobal(GlobalPlace):
    """A place on earth with one of PX4's documented setpoint types; `glide` is local only."""

    type: Literal["typed_position_global"]
    setpoint_type: Literal["takeoff", "land", "loiter", "idle"]


class ThrustTorque(SetpointModel):
    """Thrust and torque, normalised. Refused for every vehicle."""

    type: Literal["thrust_torque"]
    thrust: Annotated[tuple[float, float, float], Field(strict=False)]
    torque: Annotated[tuple[float, float, float], Field(strict=False)]


class Actuators(SetpointModel):
    """Outputs of single motors and servos. Refused for every vehicle."""

    type: Literal["actuators"]
    outputs: Annotated[tuple[float, ...], Field(strict=False, max_length=16)]


Setpoint = Annotated[
    PositionNed
    | VelocityNed
    | AccelerationNed
    | PositionVelocityNed
    | PositionVelocityAccelerationNed
    | VelocityBody
    | AccelerationBody
    | PositionBody
    | PositionOffsetNed
    | PositionGlobal
    | VelocityGlobal
    | PositionVelocityGlobal
    | AccelerationGlobal
    | Attitude
    | BodyRates
    | TypedPositionNed
    | TypedPositionGlobal
    | ThrustTorque
    | Actuators,
    Field(discriminator="type"),
]


ZERO_VELOCITY = VelocityNed(type="velocity_ned", north_m_s=0.0, east_m_s=0.0, down_m_s=0.0)
"""The setpoint for a vehicle that can hover while its client is silent."""
