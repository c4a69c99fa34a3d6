"""Differences between versions of PX4."""

from __future__ import annotations

from typing import Final

from app.domain.autopilot.base import TooOld
from app.domain.vehicle.state import FIRMWARE, FirmwareVersion, VehicleProfile

NPFG_SINCE: Final = FirmwareVersion(1, 14, 0)
"""First version with NPFG guidance. Older versions use L1."""
PAYLOAD_ITEMS_SINCE: Final = FirmwareVersion(1, 14, 0)
"""Older versions have no payload deliverer and reject a mission with such an item as MAV_MISSION_UNSUPPORTED."""
ALL_INCLUSIONS_SINCE: Final = FirmwareVersion(1, 15, 0)
"""Up to v1.14, a position may be in any inclusion. Later versions require all inclusions that contain home."""
TAKEOFF_ABOVE_HOME_ONLY_SINCE: Final = FirmwareVersion(1, 16, 0)
"""Older versions require a takeoff 1 m higher than the acceptance radius."""
FIRST_WAYPOINT_WARNS_SINCE: Final = FirmwareVersion(1, 16, 0)
"""Older versions reject a mission whose first waypoint is beyond MIS_DIST_1WP. Later versions only warn."""
ROUND_THE_FENCE_SINCE: Final = FirmwareVersion(1, 19, 0)
"""PR 27145. A build option, on by default. Without it, a return flies straight."""


def is_known_since(facts: VehicleProfile, since: FirmwareVersion) -> bool:
    """Whether the firmware is this version or later. False if unknown, which is recorded as an assumption."""
    return facts.firmware >= since if facts.firmware is not None else _unknown(facts)


def is_older(facts: VehicleProfile, since: FirmwareVersion) -> bool:
    """Whether the firmware is older. False if unknown, which is recorded as an assumption."""
    return facts.firmware < since if facts.firmware is not None else _unknown(facts)


def too_old(facts: VehicleProfile, since: FirmwareVersion) -> TooOld | None:
    """Like `is_older`, with names for messages."""
    return TooOld(f"PX4 {facts.firmware}", f"PX4 {since}") if is_older(facts, since) else None


def _unknown(facts: VehicleProfile) -> bool:
    facts.assuming(FIRMWARE)
    return False
