"""Payload components beside the autopilot: each hears COMMAND_LONG and acknowledges by itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from app.simulator.external.camera import Camera
from app.simulator.external.component import Mount, PayloadComponent

OTHERS: Final[Mapping[str, Callable[[Mount], PayloadComponent]]] = {"camera": Camera}
"""By its key in --fleet: what a vehicle may carry besides gripper and winch."""
