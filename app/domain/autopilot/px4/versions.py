"""What differs between PX4's versions."""

from __future__ import annotations

from typing import Final

from app.domain.vehicle import FIRMWARE, FirmwareVersion, VehicleFacts

NPFG_SINCE: Final = FirmwareVersion(1, 14, 0)
"""Guidance of wings; L1 before."""


def firmware(facts: VehicleFacts) -> FirmwareVersion | None:
    """None if the vehicle does not tell it: what is assumed then is up to who asks."""
    if facts.firmware is None:
        facts.assuming(FIRMWARE)
    return facts.firmware
