"""What the navigator asks of the dynamics: PX4's position setpoint triplet, in the vehicle's local frame."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum, auto


class SetpointKind(Enum):
    """position_setpoint_s.type."""

    IDLE = auto()
    """Motors idle on the ground."""
    TAKEOFF = auto()
    POSITION = auto()
    LOITER = auto()
    LAND = auto()
    DESCEND = auto()
    """Down without a position: level, wherever the wind takes it."""
    VELOCITY = auto()
    """A hovering vehicle's horizontal speed is given from cycle to cycle, its height as ever."""
    TRAJECTORY = auto()
    """A hovering vehicle's controller gets `axes` as they are (trajectory_setpoint): OFFBOARD makes no way."""


@dataclass(slots=True)
class AxisSetpoint:
    """One axis of a trajectory; NaN is not given."""

    position_m: float = math.nan
    velocity_m_s: float = math.nan
    acceleration_m_s2: float = math.nan


def _no_axes() -> tuple[AxisSetpoint, AxisSetpoint, AxisSetpoint]:
    return AxisSetpoint(), AxisSetpoint(), AxisSetpoint()


@dataclass(slots=True)
class Setpoint:
    """The current point, with what is needed of its neighbours."""

    kind: SetpointKind = SetpointKind.IDLE
    north_m: float = 0.0
    east_m: float = 0.0
    up_m: float = 0.0
    previous: tuple[float, float] | None = None
    """Where the leg came from: fixed wings and rovers follow the line."""
    next: tuple[float, float] | None = None
    """Where it goes on without a stop; None: stop here (PX4: next setpoint invalid)."""
    next_lands: bool = False
    """The next setpoint is a LAND."""
    previous_up_m: float = 0.0
    next_up_m: float = 0.0
    """Heights of the two, where they are given."""
    ramp_to_m: float = math.nan
    """Fixed wing: the height is ramped along the leg until this near; NaN: it is flown to at once."""
    acceptance_radius_m: float = 10.0
    cruise_speed_m_s: float = math.nan
    """NaN: the vehicle's own."""
    velocity: tuple[float, float] = (0.0, 0.0)
    acceleration: tuple[float, float] = (0.0, 0.0)
    """VELOCITY: north and east, m/s and m/s2."""
    axes: tuple[AxisSetpoint, AxisSetpoint, AxisSetpoint] = field(default_factory=_no_axes)
    """TRAJECTORY: north, east and up."""
    loiter_radius_m: float = 80.0
    loiter_clockwise: bool = True
    yaw_rad: float = math.nan
    """Heading to hold; NaN: the vehicle's own choice."""
    approach_slope: float = math.nan
    """Fixed wing LAND: height over distance."""

    def raise_by(self, metres: float) -> None:
        """All heights of it."""
        self.up_m += metres
        self.previous_up_m += metres
        self.next_up_m += metres

    @property
    def point(self) -> tuple[float, float]:
        """North, east."""
        return self.north_m, self.east_m
