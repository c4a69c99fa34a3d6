"""One setpoint from outside, in the vehicle's local frame: north, east, up."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class OffboardTarget:
    """What the type mask leaves; None was masked out. Metres, m/s, m/s2."""

    position: Vector | None = None
    velocity: Vector | None = None
    acceleration: Vector | None = None
    yaw_rad: float = math.nan
    thrust: float | None = None
    """SET_ATTITUDE_TARGET only."""
    tilt_rad: tuple[float, float] = field(default=(0.0, 0.0))
    """Roll and pitch of SET_ATTITUDE_TARGET."""

    @property
    def is_attitude(self) -> bool:
        """Attitude or body rates with thrust."""
        return self.thrust is not None
