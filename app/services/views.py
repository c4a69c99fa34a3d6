"""What the outside is shown of a vehicle."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

from app.domain.performance import Performance
from app.domain.reason import Reason
from app.domain.vehicle import FlightMode, GnssFix, LandedState, MissionState, VehicleState, VehicleType
from app.services.offboard_view import OffboardView


class PositionView(BaseModel):
    """A place: degrees, and metres AMSL."""

    model_config = ConfigDict(frozen=True)

    latitude_deg: float
    longitude_deg: float
    altitude_m: float


class StateView(BaseModel):
    """The newest measurements of a vehicle, with their ages in seconds; null is "never received"."""

    model_config = ConfigDict(frozen=True)

    connected: bool
    mode: FlightMode | None
    armed: bool | None
    landed: LandedState
    in_failsafe: bool
    latitude_deg: float | None
    longitude_deg: float | None
    absolute_altitude_m: float | None
    relative_altitude_m: float | None
    velocity_north_m_s: float | None
    velocity_east_m_s: float | None
    velocity_down_m_s: float | None
    heading_deg: float | None
    position_age_s: float | None
    heartbeat_age_s: float | None
    battery_percent: float | None
    home: PositionView | None
    mission_seq: int | None
    mission_total: int | None
    mission_state: MissionState
    mission_id: int | None
    vtol_state: str | None
    gnss_fix: GnssFix | None
    gnss_satellites: int | None
    gnss_hdop: float | None
    gripper_output_us: int | None
    offboard: OffboardView | None

    @classmethod
    def of(cls, state: VehicleState, offboard: OffboardView | None = None) -> StateView:
        """The view of a state, and of who flies the vehicle by hand."""
        home = state.home
        place = None if home is None else PositionView(**{n: getattr(home, n) for n in PositionView.model_fields})
        rest = {name: getattr(state, name) for name in cls.model_fields if name not in ("home", "offboard")}
        return cls(home=place, offboard=offboard, **rest)


class VehicleView(BaseModel):
    """A vehicle as shown. `quarantined` says why no command may be sent to it, null if it may.

    `performance` is what the operator declares of it, null if nothing is declared.
    """

    model_config = ConfigDict(frozen=True)

    id: str
    system_id: int
    vehicle_type: VehicleType | None
    firmware: str | None
    uid: str | None
    connection: str
    quarantined: Reason | None
    run_id: str | None
    performance: Performance | None
    state: StateView
