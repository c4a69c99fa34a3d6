"""The supported autopilots. base.py defines their interface.

To add one, create a folder with an Autopilot, add its kind to AutopilotKind, and add a line to _AUTOPILOTS.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from app.domain.autopilot.base import Autopilot, Behaviour, Quantity, Return
from app.domain.autopilot.px4 import PX4
from app.domain.vehicle.state import AutopilotKind, FirmwareVersion, VehicleProfile, VehicleType

__all__ = [
    "Autopilot",
    "Behaviour",
    "Quantity",
    "Return",
    "autopilot",
    "autopilot_kind",
    "behaviour",
    "behaviour_of",
    "quantity",
]

_AUTOPILOTS: Final[Mapping[AutopilotKind, Autopilot]] = {AutopilotKind.PX4: PX4}


_BY_MAV_AUTOPILOT: Final = {known.mav_autopilot: kind for kind, known in _AUTOPILOTS.items()}


def autopilot_kind(mav_autopilot: int) -> AutopilotKind | None:
    """Look up an autopilot by MAV_AUTOPILOT of the HEARTBEAT. Returns None if it is not supported."""
    return _BY_MAV_AUTOPILOT.get(mav_autopilot)


def autopilot(kind: AutopilotKind = AutopilotKind.PX4) -> Autopilot:
    """Return the autopilot of this kind. Plans without a vehicle are checked against it."""
    return _AUTOPILOTS[kind]


def behaviour(facts: VehicleProfile) -> Behaviour:
    return autopilot(facts.autopilot).behaviour(facts)


def behaviour_of(vehicle_type: VehicleType, firmware: FirmwareVersion | None) -> Behaviour:
    """Return the facts that follow from type and firmware alone."""
    return behaviour(VehicleProfile(vehicle_type, firmware))


def quantity(facts: VehicleProfile, which: Quantity) -> float:
    """Return a setting of this vehicle."""
    known = facts.asked.get(which)
    if known is None:
        known = facts.asked[which] = _ask(facts, which)
    value, assumed = known
    for name in assumed:
        facts.assuming(name)
    return value


def _ask(facts: VehicleProfile, which: Quantity) -> tuple[float, tuple[str, ...]]:
    """Return the value, and the facts that were assumed for it."""
    assumed: list[str] = []
    return behaviour(replace(facts, assuming=assumed.append)).quantity(which), tuple(assumed)
