"""What differs between PX4's versions."""

from __future__ import annotations

from typing import Final

from app.domain.autopilot.base import TooOld
from app.domain.vehicle.state import FIRMWARE, FirmwareVersion, VehicleProfile

NPFG_SINCE: Final = FirmwareVersion(1, 14, 0)
"""Guidance of wings; L1 before."""
PAYLOAD_ITEMS_SINCE: Final = FirmwareVersion(1, 14, 0)
"""Older firmware has no payload deliverer and answers a mission with such an item MAV_MISSION_UNSUPPORTED."""
ALL_INCLUSIONS_SINCE: Final = FirmwareVersion(1, 15, 0)
"""Up to v1.14 a point may lie in any inclusion; newer firmware wants it in all of those that contain home."""
TAKEOFF_ABOVE_HOME_ONLY_SINCE: Final = FirmwareVersion(1, 16, 0)
"""Older firmware wants the takeoff to be 1 m higher than the acceptance radius."""
FIRST_WAYPOINT_WARNS_SINCE: Final = FirmwareVersion(1, 16, 0)
"""Older firmware refuses a mission whose first waypoint is farther than MIS_DIST_1WP, newer only warns."""
ROUND_THE_FENCE_SINCE: Final = FirmwareVersion(1, 19, 0)
"""PR 27145. A build option, on by default; without it a return flies straight."""


def is_known_since(facts: VehicleProfile, since: FirmwareVersion) -> bool:
    """Whether the firmware is this one or newer; False if the vehicle does not tell it, which is noted."""
    return facts.firmware >= since if facts.firmware is not None else _unknown(facts)


def is_older(facts: VehicleProfile, since: FirmwareVersion) -> bool:
    """Whether the firmware is older; False if the vehicle does not tell it, which is noted."""
    return facts.firmware < since if facts.firmware is not None else _unknown(facts)


def too_old(facts: VehicleProfile, since: FirmwareVersion) -> TooOld | None:
    """As `is_older`, for people."""
    return TooOld(f"PX4 {facts.firmware}", f"PX4 {since}") if is_older(facts, since) else None


def _unknown(facts: VehicleProfile) -> bool:
    facts.assuming(FIRMWARE)
    return False
