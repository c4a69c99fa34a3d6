"""MAV_TYPE of the HEARTBEAT and of plan files, and the vehicle types whose braking semantics differ."""

from __future__ import annotations

from typing import Final

from app.domain.vehicle import VehicleType

_TYPES: Final = {
    1: VehicleType.FIXED_WING,
    2: VehicleType.MULTICOPTER,  # quadrotor
    3: VehicleType.MULTICOPTER,  # coaxial helicopter
    4: VehicleType.MULTICOPTER,  # helicopter
    7: VehicleType.AIRSHIP,
    10: VehicleType.ROVER,
    13: VehicleType.MULTICOPTER,  # hexarotor
    14: VehicleType.MULTICOPTER,  # octorotor
    15: VehicleType.MULTICOPTER,  # tricopter
    **dict.fromkeys(range(19, 26), VehicleType.VTOL),
    29: VehicleType.MULTICOPTER,  # dodecarotor
    35: VehicleType.MULTICOPTER,  # decarotor
}

_USUAL: Final = {
    VehicleType.FIXED_WING: 1,
    VehicleType.MULTICOPTER: 2,
    VehicleType.AIRSHIP: 7,
    VehicleType.ROVER: 10,
    VehicleType.VTOL: 22,  # fixed rotors: what PX4 calls a standard VTOL
}


def vehicle_type(mav_type: int) -> VehicleType | None:
    """The vehicle type; None for a MAV_TYPE that Waydrop cannot fly."""
    return _TYPES.get(mav_type)


def usual_mav_type(kind: VehicleType) -> int:
    """The MAV_TYPE that stands for a vehicle type where a file wants one."""
    return _USUAL[kind]
