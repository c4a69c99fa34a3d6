"""The vehicle as a setpoint meets it: what it flies like, where it is, which fence it has on board."""

from __future__ import annotations

from dataclasses import dataclass, field

from app.domain.autopilot import autopilot, behaviour_of
from app.domain.fence_area import FenceArea
from app.domain.geo import LocalProjection
from app.domain.setpoint.capability import FirmwareProfile, FlightKind, flight_kind
from app.domain.setpoint.encode import Follower
from app.domain.setpoint.limiter import Whereabouts
from app.domain.setpoint.means import Means, means_if_any
from app.domain.setpoint.message import Vector
from app.domain.tasks.commanded import Wing
from app.domain.vehicle import FirmwareVersion, VehicleState, VehicleType


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What stays as it is during one lease. `fence` is in metres around the home it was read with.

    `wing`: how it flies to a place by command.
    """

    vehicle_type: VehicleType
    profile: FirmwareProfile
    fresh_s: float
    fence: FenceArea | None = None
    wing: Wing = field(default_factory=Wing)

    @classmethod
    def of(cls, vehicle_type: VehicleType, firmware: FirmwareVersion | None, fresh_s: float) -> Surroundings:
        """Before anything was read."""
        known = behaviour_of(vehicle_type, firmware)
        return cls(vehicle_type, autopilot().setpoint_profile(firmware), fresh_s, wing=Wing.of(None, known))

    def means(self, state: VehicleState) -> Means | None:
        """How its tasks are flown as it flies now; None: not at all."""
        return means_if_any(self.kind(state), self.profile)

    def kind(self, state: VehicleState) -> FlightKind:
        """What it flies like now."""
        return flight_kind(self.vehicle_type, state.vtol_state)

    def follower(self, state: VehicleState) -> Follower:
        """What a setpoint is encoded for."""
        home_m = None if state.home is None else state.home.altitude_m
        return Follower(self.kind(state), self.profile, home_m, has_estimate=self.has_estimate(state))

    def has_estimate(self, state: VehicleState) -> bool:
        """Whether a position came lately: PX4 sends none without a valid estimate."""
        return state.position_age_s is not None and state.position_age_s <= self.fresh_s

    def whereabouts(self, state: VehicleState) -> Whereabouts:
        """What a setpoint is limited by."""
        home = state.home
        velocity = (state.velocity_north_m_s or 0.0, state.velocity_east_m_s or 0.0, -(state.velocity_down_m_s or 0.0))
        return Whereabouts(
            kind=self.kind(state),
            home=None if home is None else (home.latitude_deg, home.longitude_deg, home.altitude_m),
            home_ned=state.home_ned_m,
            here=_from_home(state) if self.has_estimate(state) else None,
            velocity=velocity,
            heading_deg=state.heading_deg or 0.0,
            fence=self.fence,
        )


def _from_home(state: VehicleState) -> Vector | None:
    """North, east, up in metres."""
    home = state.home
    if home is None or state.latitude_deg is None or state.longitude_deg is None or state.absolute_altitude_m is None:
        return None
    east, north = LocalProjection(home.latitude_deg, home.longitude_deg).to_local(
        state.latitude_deg, state.longitude_deg
    )
    return north, east, state.absolute_altitude_m - home.altitude_m
