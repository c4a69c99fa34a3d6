"""What is asked of an autopilot. Each has one folder: its parameters and what they mean, its modes, what it accepts.

Outside of these folders, vehicles/ and simulator/ nobody names a parameter, a mode number or a firmware version. An
answer that an operator may want to change carries the name of its setting and how to change it.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum, auto
from typing import Protocol

from app.domain.plan.walk import Carried
from app.domain.vehicle import VehicleFacts, VehicleType


class Quantity(StrEnum):
    """A number that a vehicle is set to, in the unit that its name says."""

    ACCEPTANCE_RADIUS_M = auto()
    LOITER_RADIUS_M = auto()
    """Its sign is the direction."""
    HOVER_CRUISE_M_S = auto()
    HOVER_FASTEST_M_S = auto()
    HOVER_ACCELERATION_M_S2 = auto()
    HOVER_JERK_M_S3 = auto()
    CORNER_SHARE = auto()
    """Of the acceleration: what a corner may take."""
    CLIMB_M_S = auto()
    CLIMB_ACCELERATION_M_S2 = auto()
    SINK_M_S = auto()
    SINK_ACCELERATION_M_S2 = auto()
    SPOOL_UP_S = auto()
    TAKEOFF_RAMP_S = auto()
    TAKEOFF_M_S = auto()
    TAKEOFF_HEIGHT_M = auto()
    """Where no takeoff says how high."""
    LANDING_M_S = auto()
    LANDING_SLOWS_BELOW_M = auto()
    LANDING_SLOW_BELOW_M = auto()
    WING_CRUISE_M_S = auto()
    WING_SLOWEST_M_S = auto()
    WING_FASTEST_M_S = auto()
    WING_CLIMB_M_S = auto()
    WING_SINK_M_S = auto()
    WING_TAKEOFF_CLIMB_M_S = auto()
    WING_LANDING_M_S = auto()
    """0 or less: as slow as it flies."""
    WING_ALTITUDE_RADIUS_M = auto()
    WING_LANDING_ALTITUDE_RADIUS_M = auto()
    GLIDE_DEG = auto()
    TRANSITION_M_S = auto()
    WHEELS_FASTEST_M_S = auto()
    GRIPPER_S = auto()
    """How long the gripper moves."""
    RETURN_HEIGHT_M = auto()
    RETURN_NEAR_M = auto()
    """Within it a return climbs less, by the cone."""
    RETURN_CONE_DEG = auto()


class Behaviour(Protocol):
    """What one vehicle does, by its autopilot, its firmware and its settings.

    What it does not tell is assumed: the autopilot's own default, the strict one where they differ. Whoever asks notes
    that by VehicleFacts.assuming.
    """

    def quantity(self, which: Quantity) -> float:
        """0 if this vehicle type has no such thing."""

    def usable(self) -> VehicleFacts:
        """The same vehicle within bounds that can be predicted with: it may be set to what none can fly."""

    def switch_distance_m(self, ground_speed_m_s: float) -> float:
        """Fixed wing: how far before a waypoint the next one counts, and this one as reached."""

    def reach_m(self, carried: Carried, ground_speed_m_s: float, acceptance_radius_m: float | None = None) -> float:
        """Distance before the point at which an item counts as reached; an item's own radius where that counts."""

    @property
    def steepest_glide_deg(self) -> float:
        """Steeper landings of a fixed wing are refused."""


class Autopilot(Protocol):
    """What is the same for all vehicles that it flies."""

    def behaviour(self, facts: VehicleFacts) -> Behaviour:
        """Of one vehicle."""

    def defaults(self, vehicle_type: VehicleType) -> Mapping[str, float | int]:
        """What a vehicle that nobody set is set to: all parameters that plans are checked against."""
