"""What the land detectors read in one cycle: the topics they subscribe to in PX4, as far as they use them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, auto

from app.simulator.wire import Mode

WITHOUT_CLIMB_CONTROL = frozenset({Mode.MANUAL, Mode.ACRO, Mode.STABILIZED, Mode.TERMINATION})


class TakeoffState(Enum):
    """takeoff_status_s.takeoff_state, of multicopters."""

    GROUND = auto()
    RAMPUP = auto()
    """The thrust rises, the vehicle still stands."""
    FLIGHT = auto()


@dataclass(slots=True)
class LandSample:
    """Metres, m/s, m/s2, rad/s; throttle 0..1. Speeds are sizes, without a sign."""

    armed: bool
    mode: Mode
    fixed_wing: bool
    """vehicle_status.vehicle_type: a VTOL is fixed wing only when its transition is complete."""
    v_xy_m_s: float
    v_xy_valid: bool
    v_z_m_s: float
    climb_command_m_s: float
    """What the position controller is told to do, up is positive."""
    throttle: float
    hover_throttle: float | None
    """The hover thrust estimate; None while there is none (it needs flight)."""
    airspeed_m_s: float | None
    """None without a sensor."""
    specific_force_m_s2: float
    """Size of what the accelerometer feels: 9.81 at rest, 0 in free fall."""
    acceleration_xy_m_s2: float
    """Accelerometer, in the body's x and y."""
    rate_xy_rad_s: float
    rate_rad_s: float
    dist_bottom_m: float | None
    """Range to the ground; None while it is not valid."""
    has_range_sensor: bool
    takeoff_state: TakeoffState
    home_distance_m: float = math.inf
    """Over ground; infinite while home is unknown."""

    @property
    def climb_rate_controlled(self) -> bool:
        """flag_control_climb_rate_enabled: in all modes but the plainly manual ones and a terminated flight."""
        return self.mode not in WITHOUT_CLIMB_CONTROL
