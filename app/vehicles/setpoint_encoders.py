"""The three setpoint messages as mavlink_direct wants them: every field named, ints as ints, NaN as null."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Final

from app.domain.setpoint.message import AttitudeTarget, GlobalTarget, LocalTarget, SetpointMessage, Vector
from app.vehicles.encoders import Field, float_field, unsigned_field

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
        fields: dict[str, Field | list[Field]] = {
            "time_boot_ms": 0,
            "target_system": unsigned_field(target_system, 8),
            "target_component": unsigned_field(target_component, 8),
        }
        match self.message:
            case LocalTarget():
                fields |= _local(self.message)
            case GlobalTarget():
                fields |= _global(self.message)
            case AttitudeTarget():
                fields |= _attitude(self.message)
        return json.dumps(fields, allow_nan=False)


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
        raise ValueError(f"{value!r} is no angle within {most:g} degrees")
    return round(value * _E7)
