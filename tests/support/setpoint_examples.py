"""One setpoint of every form, and strategies that make more."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st
from pydantic import TypeAdapter

from app.domain.autopilot.capability import FirmwareProfile, FlightKind
from app.domain.offboard.encode import Follower
from app.domain.offboard.setpoints import Setpoint

_SETPOINT: TypeAdapter[Setpoint] = TypeAdapter(Setpoint)
NED: dict[str, Any] = {"north_m": 10.0, "east_m": -4.0, "down_m": -12.0}
PLACE: dict[str, Any] = {"latitude_deg": 47.398, "longitude_deg": 8.546, "altitude_m": 500.0}
VELOCITY: dict[str, Any] = {"north_m_s": 2.0, "east_m_s": -1.0, "down_m_s": -0.5}
ACCELERATION: dict[str, Any] = {"north_m_s2": 0.5, "east_m_s2": 0.25, "down_m_s2": -0.125}
EXAMPLES: dict[str, dict[str, Any]] = {
    "position_ned": NED,
    "velocity_ned": VELOCITY,
    "acceleration_ned": ACCELERATION,
    "position_velocity_ned": {**NED, **VELOCITY},
    "position_velocity_acceleration_ned": {**NED, **VELOCITY, **ACCELERATION},
    "velocity_body": {"forward_m_s": 2.0, "right_m_s": -1.0, "down_m_s": 0.5},
    "acceleration_body": {"forward_m_s2": 0.5, "right_m_s2": -0.25, "down_m_s2": 0.125},
    "position_body": {"forward_m": 2.0},
    "position_offset_ned": NED,
    "position_global": PLACE,
    "velocity_global": VELOCITY,
    "position_velocity_global": {**PLACE, **VELOCITY},
    "acceleration_global": ACCELERATION,
    "attitude": {"roll_deg": 5.0, "pitch_deg": -3.0, "yaw_deg": 90.0, "thrust": 0.5},
    "body_rates": {"roll_deg_s": 5.0, "pitch_deg_s": -3.0, "yaw_deg_s": 10.0, "thrust": 0.5},
    "typed_position_ned": {**NED, "setpoint_type": "loiter"},
    "typed_position_global": {**PLACE, "setpoint_type": "loiter"},
    "thrust_torque": {"thrust": [0.0, 0.0, -0.5], "torque": [0.0, 0.0, 0.0]},
    "actuators": {"outputs": [0.5, 0.5]},
}


def setpoint_of(document: dict[str, Any]) -> Setpoint:
    """As read from JSON. Raises ValidationError."""
    return _SETPOINT.validate_python(document)


def example(form: str, **changes: Any) -> Setpoint:
    """The example of a form, changed."""
    return setpoint_of({"type": form, **EXAMPLES[form], **changes})


def follower(kind: FlightKind = FlightKind.ROTARY, profile: FirmwareProfile = FirmwareProfile.FLOWN) -> Follower:
    """A vehicle with home at 488 m and an estimate."""
    return Follower(kind, profile, 488.0)


speeds = st.floats(-150, 150, allow_nan=False)
metres = st.floats(-50_000, 50_000, allow_nan=False)
velocities = st.builds(
    lambda n, e, d: example("velocity_ned", north_m_s=n, east_m_s=e, down_m_s=d), speeds, speeds, speeds
)
body_velocities = st.builds(
    lambda f, r, d: example("velocity_body", forward_m_s=f, right_m_s=r, down_m_s=d), speeds, speeds, speeds
)
places = st.builds(lambda n, e, d: example("position_ned", north_m=n, east_m=e, down_m=d), metres, metres, metres)
attitudes = st.builds(
    lambda r, p: example("attitude", roll_deg=r, pitch_deg=p), st.floats(-180, 180), st.floats(-90, 90)
)
