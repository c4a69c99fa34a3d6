"""The messages that Waydrop sends, each with its own typed fields.

mavsdk's mavlink_direct takes JSON and says SUCCESS to anything: a misspelt field, a float for an int or a number out of
range silently sends something else, an omitted float sends 0. So nothing is sent but what is defined here, checked and
complete; a test decodes what arrives.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Protocol

from app.domain.offboard.messages import AttitudeTarget, GlobalTarget, LocalTarget, SetpointMessage, Vector

_FLOAT_MAX: Final = 3.4028234663852886e38
Field = int | float | str | None


class Outgoing(Protocol):
    """A message that can be sent."""

    @property
    def name(self) -> str:
        """The MAVLink message name."""

    def fields_json(self, target_system: int, target_component: int) -> str:
        """All fields, as mavlink_direct wants them."""


@dataclass(frozen=True, slots=True)
class GroundHeartbeat:
    """HEARTBEAT of a ground station: PX4 sends no STATUSTEXT on a link where it has not seen one."""

    name = "HEARTBEAT"

    def fields_json(self, _target_system: int, _target_component: int) -> str:
        """All fields: MAV_TYPE_GCS, MAV_AUTOPILOT_INVALID, MAV_STATE_ACTIVE."""
        fields = {"type": 6, "autopilot": 8, "base_mode": 0, "custom_mode": 0, "system_status": 4}
        return json.dumps({**fields, "mavlink_version": 3})


@dataclass(frozen=True, slots=True)
class CommandLong:
    """COMMAND_LONG. `params` are param1..7, NaN means "not given"; `confirmation` counts the repetitions."""

    command: int
    params: tuple[float, float, float, float, float, float, float]
    confirmation: int = 0

    name = "COMMAND_LONG"

    def fields_json(self, target_system: int, target_component: int) -> str:
        """All fields. Raises ValueError for what MAVLink cannot carry."""
        fields: dict[str, Field] = {f"param{n}": float_field(value) for n, value in enumerate(self.params, start=1)}
        fields["command"] = unsigned_field(self.command, 16)
        fields["confirmation"] = unsigned_field(self.confirmation, 8)
        return _targeted(fields, target_system, target_component)


@dataclass(frozen=True, slots=True)
class CommandInt:
    """COMMAND_INT in MAV_FRAME_GLOBAL: `z` is above sea level. `x`, `y` are 1e7 degrees. It has no confirmation."""

    command: int
    params: tuple[float, float, float, float]
    x: int
    y: int
    z: float

    name = "COMMAND_INT"

    def fields_json(self, target_system: int, target_component: int) -> str:
        """All fields. Raises ValueError for what MAVLink cannot carry."""
        fields: dict[str, Field] = {f"param{n}": float_field(value) for n, value in enumerate(self.params, start=1)}
        fields |= {"frame": 0, "current": 0, "autocontinue": 0, "command": unsigned_field(self.command, 16)}
        fields |= {"x": signed_field(self.x, 32), "y": signed_field(self.y, 32), "z": float_field(self.z)}
        return _targeted(fields, target_system, target_component)


@dataclass(frozen=True, slots=True)
class ParamRequestRead:
    """PARAM_REQUEST_READ by name."""

    param_id: str

    name = "PARAM_REQUEST_READ"

    def fields_json(self, target_system: int, target_component: int) -> str:
        """All fields. Raises ValueError if the name is longer than 16 characters."""
        if not self.param_id.isascii() or not 0 < len(self.param_id) <= 16:
            raise ValueError(f"not a parameter name: {self.param_id!r}")
        return _targeted({"param_id": self.param_id, "param_index": -1}, target_system, target_component)


@dataclass(frozen=True, slots=True)
class MissionClearAll:
    """MISSION_CLEAR_ALL of one list."""

    mission_type: int

    name = "MISSION_CLEAR_ALL"

    def fields_json(self, target_system: int, target_component: int) -> str:
        return _targeted({"mission_type": unsigned_field(self.mission_type, 8)}, target_system, target_component)


@dataclass(frozen=True, slots=True)
class MissionAckOut:
    """MISSION_ACK to the vehicle; type 15 (OPERATION_CANCELLED) ends a transfer that it still waits in."""

    mission_type: int
    type: int = 15

    name = "MISSION_ACK"

    def fields_json(self, target_system: int, target_component: int) -> str:
        fields: dict[str, Field] = {
            "type": unsigned_field(self.type, 8),
            "mission_type": unsigned_field(self.mission_type, 8),
            "opaque_id": 0,
        }
        return _targeted(fields, target_system, target_component)


@dataclass(frozen=True, slots=True)
class MissionSetCurrent:
    """MISSION_SET_CURRENT: has no ack; for firmware that does not know command 224."""

    seq: int

    name = "MISSION_SET_CURRENT"

    def fields_json(self, target_system: int, target_component: int) -> str:
        return _targeted({"seq": unsigned_field(self.seq, 16)}, target_system, target_component)


def _targeted(fields: Mapping[str, Field | list[Field]], target_system: int, target_component: int) -> str:
    target = {
        "target_system": unsigned_field(target_system, 8),
        "target_component": unsigned_field(target_component, 8),
    }
    return json.dumps({**target, **fields}, allow_nan=False)


def unsigned_field(value: int, bits: int) -> int:
    """A number for an unsigned field of so many bits. Raises ValueError for any other."""
    if not isinstance(value, int) or not 0 <= value < 1 << bits:
        raise ValueError(f"{value!r} is not an unsigned {bits}-bit number")
    return int(value)


def signed_field(value: int, bits: int) -> int:
    """A number for a signed field of so many bits. Raises ValueError for any other."""
    if not isinstance(value, int) or not -(1 << bits - 1) <= value < 1 << bits - 1:
        raise ValueError(f"{value!r} is not a signed {bits}-bit number")
    return int(value)


def float_field(value: float) -> float | None:
    """A number for a 32 bit float field; NaN as null. Raises ValueError for what is too large."""
    if math.isnan(value):
        return None  # NaN on the wire
    if abs(value) > _FLOAT_MAX:
        raise ValueError(f"{value!r} is not a finite 32-bit float")
    return float(value)


_E7: Final = 1e7


@dataclass(frozen=True, slots=True)
class SetpointOut:
    """One setpoint on its way out. `time_boot_ms` is 0: PX4 goes by the time of arrival."""

    message: SetpointMessage

    @property
    def name(self) -> str:
        """The MAVLink message name."""
        return self.message.name

    def fields_json(self, target_system: int, target_component: int) -> str:
        """All fields. Raises ValueError for what MAVLink cannot carry."""
        return setpoint_json(self.message, target_system, target_component)


@lru_cache(maxsize=64)
def setpoint_json(message: SetpointMessage, target_system: int, target_component: int) -> str:
    """Encoded once: the same setpoint is sent at each tick until a newer one replaces it."""
    match message:
        case LocalTarget():
            fields = _local(message)
        case GlobalTarget():
            fields = _global(message)
        case AttitudeTarget():
            fields = _attitude(message)
    return _targeted({"time_boot_ms": 0, **fields}, target_system, target_component)


def _local(target: LocalTarget) -> dict[str, Field | list[Field]]:
    return {
        "coordinate_frame": unsigned_field(int(target.frame), 8),
        "type_mask": unsigned_field(int(target.type_mask), 16),
        **_three(("x", "y", "z"), target.position),
        **_three(("vx", "vy", "vz"), target.velocity),
        **_three(("afx", "afy", "afz"), target.acceleration),
        "yaw": float_field(target.yaw_rad),
        "yaw_rate": float_field(target.yaw_rate_rad_s),
    }


def _global(target: GlobalTarget) -> dict[str, Field | list[Field]]:
    return {
        "coordinate_frame": unsigned_field(int(target.frame), 8),
        "type_mask": unsigned_field(int(target.type_mask), 16),
        "lat_int": _degrees(target.latitude_deg, 90.0),
        "lon_int": _degrees(target.longitude_deg, 180.0),
        "alt": float_field(target.altitude_m),
        **_three(("vx", "vy", "vz"), target.velocity),
        **_three(("afx", "afy", "afz"), (math.nan, math.nan, math.nan)),
        "yaw": float_field(target.yaw_rad),
        "yaw_rate": float_field(target.yaw_rate_rad_s),
    }


def _attitude(target: AttitudeTarget) -> dict[str, Field | list[Field]]:
    roll, pitch, yaw = target.rates_rad_s
    return {
        "type_mask": unsigned_field(int(target.type_mask), 8),
        "q": [float_field(part) for part in target.q],
        "body_roll_rate": float_field(roll),
        "body_pitch_rate": float_field(pitch),
        "body_yaw_rate": float_field(yaw),
        "thrust": float_field(target.thrust),
        "thrust_body": [0.0, 0.0, 0.0],
    }


def _three(names: tuple[str, str, str], values: Vector) -> dict[str, Field | list[Field]]:
    return {name: float_field(value) for name, value in zip(names, values, strict=True)}


def _degrees(value: float, most: float) -> int:
    if not -most <= value <= most:
        raise ValueError(f"{value!r} is not an angle within {most:g} degrees")
    return round(value * _E7)
