"""The face of a vehicle's motion towards the rest of the simulator."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from app.simulator.setpoint import Setpoint
from app.simulator.state import Body


@dataclass(slots=True)
class Wind:
    """Speed of the air over ground."""

    north_m_s: float = 0.0
    east_m_s: float = 0.0


class Dynamics(Protocol):
    """Moves a body towards a setpoint, one fixed step at a time."""

    def reset(self, body: Body) -> None:
        """Take over a body in any state."""

    def step(self, body: Body, setpoint: Setpoint, dt_s: float, wind: Wind) -> None:
        """Advance by `dt_s`; called only while armed."""

    def transition(self, wanted: int) -> None:
        """VTOL only: change to MAV_VTOL_STATE `wanted` (3 multicopter, 4 fixed wing)."""
