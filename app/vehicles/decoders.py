"""The messages that Waydrop reads, each decoded from mavlink_direct's JSON into its own type, in MAVLink's units."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from pydantic_core import from_json

from app.domain.vehicle.state import Picture

Fields = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """HEARTBEAT."""

    type: int
    autopilot: int
    base_mode: int
    custom_mode: int
    system_status: int


@dataclass(frozen=True, slots=True)
class CurrentMode:
    """CURRENT_MODE (v1.15 and later)."""

    custom_mode: int
    intended_custom_mode: int


@dataclass(frozen=True, slots=True)
class ExtendedSysState:
    """EXTENDED_SYS_STATE."""

    vtol_state: int
    landed_state: int


@dataclass(frozen=True, slots=True)
class GlobalPositionInt:
    """GLOBAL_POSITION_INT: 1e7 deg, mm, cm/s, cdeg (65535: unknown), ms since boot."""

    time_boot_ms: int
    lat: int
    lon: int
    alt: int
    relative_alt: int
    vx: int
    vy: int
    vz: int
    hdg: int


@dataclass(frozen=True, slots=True)
class GpsRawInt:
    """GPS_RAW_INT: GPS_FIX_TYPE, HDOP in hundredths (65535: unknown), satellites (255: unknown)."""

    fix_type: int
    eph: int
    satellites_visible: int


@dataclass(frozen=True, slots=True)
class HomePosition:
    """HOME_POSITION: 1e7 deg, mm AMSL; x, y, z: the same place from the EKF origin, m north, east, down."""

    latitude: int
    longitude: int
    altitude: int
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass(frozen=True, slots=True)
class BatteryStatus:
    """BATTERY_STATUS: per cent, -1 unknown."""

    id: int
    battery_remaining: int


@dataclass(frozen=True, slots=True)
class SysStatus:
    """SYS_STATUS: per cent, -1 unknown."""

    battery_remaining: int


@dataclass(frozen=True, slots=True)
class SystemTime:
    """SYSTEM_TIME: ms since boot."""

    time_boot_ms: int


@dataclass(frozen=True, slots=True)
class MissionCurrentReport:
    """MISSION_CURRENT. Older firmware sends `seq` alone: the rest is 0."""

    seq: int
    total: int
    mission_state: int
    mission_mode: int
    mission_id: int
    fence_id: int
    rally_points_id: int


@dataclass(frozen=True, slots=True)
class MissionItemReached:
    """MISSION_ITEM_REACHED."""

    seq: int


@dataclass(frozen=True, slots=True)
class MissionAck:
    """MISSION_ACK."""

    target_system: int
    target_component: int
    type: int
    mission_type: int
    opaque_id: int


@dataclass(frozen=True, slots=True)
class CommandAckReport:
    """COMMAND_ACK; `progress` 255: unknown."""

    command: int
    result: int
    progress: int
    target_system: int
    target_component: int


@dataclass(frozen=True, slots=True)
class ServoOutputRaw:
    """SERVO_OUTPUT_RAW: `outputs_us` of output 1 to 16, 0 where the message has none."""

    port: int
    outputs_us: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class StatusTextChunk:
    """STATUSTEXT: `id` 0 is a whole text; else chunks of 50 bytes count from `chunk_seq` 0."""

    severity: int
    text: str
    id: int
    chunk_seq: int


@dataclass(frozen=True, slots=True)
class AutopilotVersion:
    """AUTOPILOT_VERSION."""

    flight_sw_version: int
    uid: int
    uid2: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class ParamValue:
    """PARAM_VALUE. `value` None: the bits are no float, so they are a negative int (PX4 packs ints bytewise).

    `param_index` 65535: PX4 has not looked it up itself.
    """

    param_id: str
    param_type: int
    value: float | None
    param_index: int = 0


@dataclass(frozen=True, slots=True)
class ParamError:
    """PARAM_ERROR (v1.18 and later): 1 does not exist."""

    target_system: int
    target_component: int
    param_id: str
    error: int


@dataclass(frozen=True, slots=True)
class EventReport:
    """EVENT: an id and up to 40 bytes of arguments."""

    id: int
    arguments: bytes


def _plain(kind: type[Any]) -> Callable[[Fields], Any]:
    names = tuple(kind.__dataclass_fields__)
    return lambda fields: kind(*[int(fields.get(name, 0)) for name in names])


def _home(fields: Fields) -> HomePosition:
    place = (int(fields["latitude"]), int(fields["longitude"]), int(fields["altitude"]))
    return HomePosition(*place, *(float(fields.get(name) or 0.0) for name in ("x", "y", "z")))


_OUTPUTS: Final = tuple(f"servo{number}_raw" for number in range(1, 17))


def _servo(fields: Fields) -> ServoOutputRaw:
    outputs = [int(fields.get(name, 0)) for name in _OUTPUTS]
    return ServoOutputRaw(port=int(fields.get("port", 0)), outputs_us=tuple(outputs))


def _text(fields: Fields) -> StatusTextChunk:
    return StatusTextChunk(
        severity=int(fields["severity"]),
        text=str(fields["text"]),
        id=int(fields.get("id", 0)),
        chunk_seq=int(fields.get("chunk_seq", 0)),
    )


def _version(fields: Fields) -> AutopilotVersion:
    return AutopilotVersion(
        flight_sw_version=int(fields["flight_sw_version"]),
        uid=int(fields.get("uid", 0)),
        uid2=tuple(int(byte) for byte in fields.get("uid2", ())),
    )


def _param(fields: Fields) -> ParamValue:
    value = fields["param_value"]
    known = value is not None and math.isfinite(value)
    index = int(fields.get("param_index", 0))
    return ParamValue(str(fields["param_id"]), int(fields["param_type"]), float(value) if known else None, index)


def _param_error(fields: Fields) -> ParamError:
    return ParamError(
        int(fields["target_system"]), int(fields["target_component"]), str(fields["param_id"]), int(fields["error"])
    )


def _event(fields: Fields) -> EventReport:
    return EventReport(int(fields["id"]), bytes(int(byte) for byte in fields.get("arguments", ())))


@dataclass(frozen=True, slots=True)
class Report:
    """A message, of any component of the vehicle, whose newest is a field of VehicleState."""

    field: str
    value: object


def _picture(fields: Fields) -> Report:
    place = (int(fields["lat"]) / 1e7, int(fields["lon"]) / 1e7, int(fields["alt"]) / 1e3)
    taken = Picture(int(fields["image_index"]), int(fields["capture_result"]) == 1, *place, str(fields["file_url"]))
    return Report("picture", taken)


REPORTS: Final[Mapping[str, Callable[[Fields], Report]]] = {"CAMERA_IMAGE_CAPTURED": _picture}
"""These messages, by name."""
DECODERS: Final[Mapping[str, Callable[[Fields], Any]]] = {
    "HEARTBEAT": _plain(Heartbeat),
    "CURRENT_MODE": _plain(CurrentMode),
    "EXTENDED_SYS_STATE": _plain(ExtendedSysState),
    "GLOBAL_POSITION_INT": _plain(GlobalPositionInt),
    "GPS_RAW_INT": _plain(GpsRawInt),
    "HOME_POSITION": _home,
    "BATTERY_STATUS": _plain(BatteryStatus),
    "SYS_STATUS": _plain(SysStatus),
    "SYSTEM_TIME": _plain(SystemTime),
    "MISSION_CURRENT": _plain(MissionCurrentReport),
    "MISSION_ITEM_REACHED": _plain(MissionItemReached),
    "MISSION_ACK": _plain(MissionAck),
    "COMMAND_ACK": _plain(CommandAckReport),
    "SERVO_OUTPUT_RAW": _servo,
    "STATUSTEXT": _text,
    "AUTOPILOT_VERSION": _version,
    "PARAM_VALUE": _param,
    "PARAM_ERROR": _param_error,
    "EVENT": _event,
    **REPORTS,
}
"""All messages that are read, by name."""


def decode(name: str, body: str) -> Any:
    """The message, of the type that DECODERS names.

    Raises:
        ValueError: the JSON cannot be read or a field is missing or of the wrong kind.
    """
    try:
        return DECODERS[name](from_json(body))  # three times as fast as json.loads
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"{name} cannot be read: {body[:200]}") from error
