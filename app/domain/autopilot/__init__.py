"""The autopilots that Waydrop knows; see base.py for what is asked of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from app.domain.autopilot.base import Autopilot, Behaviour, Quantity
from app.domain.autopilot.px4 import Px4
from app.domain.vehicle import AutopilotKind, VehicleFacts

__all__ = ["Autopilot", "Behaviour", "Quantity", "autopilot", "behaviour", "quantity"]

_AUTOPILOTS: Final[Mapping[AutopilotKind, Autopilot]] = {AutopilotKind.PX4: Px4()}


def autopilot(kind: AutopilotKind = AutopilotKind.PX4) -> Autopilot:
    """What flies vehicles of this kind; what a plan without a vehicle is checked against."""
    return _AUTOPILOTS[kind]


def behaviour(facts: VehicleFacts) -> Behaviour:
    """What this vehicle does."""
    return autopilot(facts.autopilot).behaviour(facts)


def quantity(facts: VehicleFacts, which: Quantity) -> float:
    """What this vehicle is set to."""
    return behaviour(facts).quantity(which)
