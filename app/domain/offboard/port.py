"""The part of the vehicle's port that offboard control needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from app.domain.setpoint.message import SetpointMessage


class OffboardLink(Protocol):
    """Every method may raise LinkError."""

    async def enter_offboard(self) -> None:
        """OFFBOARD mode, seen in the HEARTBEAT. Setpoints must flow before, and go on."""

    def send_setpoint(self, message: SetpointMessage) -> None:
        """Send one setpoint, once, now. Never blocks; nothing repeats it."""

    async def read_parameters(self, names: Sequence[str]) -> Mapping[str, float | int]:
        """These parameters as they are now, not from a cache; one that does not answer is left out."""
