"""Fly to a position."""

from __future__ import annotations

from typing import ClassVar, Literal

from app.domain.geo import LatLon
from app.domain.items.base import YAW, CommandForm, Draft, Forms, Item, Leg, Param, Predictor, T, or_nan, position_draft
from app.domain.items.change_speed import speed_drafts
from app.domain.items.fields import Altitude, Point, Position, RadiusM, Seconds, SpeedMS, YawDeg, relative_altitude_m
from app.domain.mission import MavCmd
from app.domain.vehicle.state import IN_AIR, FlightRegime, GlobalPosition, VehicleType


class Stop(Item, Position):
    """An item with a position where a drop can follow."""

    is_stop: ClassVar[bool] = True
    moves: ClassVar[bool] = True

    yaw_deg: YawDeg | None = None

    def altitude(self) -> Altitude:
        return self

    def point(self) -> Point:
        return Point(latitude_deg=self.latitude_deg, longitude_deg=self.longitude_deg)

    def end_of(self, home: GlobalPosition, here: LatLon) -> LatLon:
        return LatLon(self.latitude_deg, self.longitude_deg, relative_altitude_m(self, home))

    def waypoint_draft(self, hold_s: float, acceptance_radius_m: float | None) -> Draft:
        """NAV_WAYPOINT here. A multicopter stops only with both hold and radius (flown)."""
        params = (hold_s, or_nan(acceptance_radius_m), 0.0, or_nan(self.yaw_deg))
        return position_draft(MavCmd.NAV_WAYPOINT, self, self, params)


class AirStop(Stop):
    """In flight if the vehicle can fly: it takes off on its way there."""

    flies: ClassVar[bool] = True

    def carried_after(self, vehicle_type: VehicleType, before: FlightRegime) -> FlightRegime:
        return IN_AIR[vehicle_type] if before is FlightRegime.GROUND else before


class Waypoint(AirStop):
    """Fly through a position, or stop there for `hold_s` (rotary wings only).

    `speed_m_s` is the speed towards it and from then on.
    """

    forms: ClassVar[Forms] = {
        MavCmd.NAV_WAYPOINT: CommandForm(
            "waypoint",
            {"hold_s": Param(1, zero_is_none=True), "acceptance_radius_m": Param(2, zero_is_none=True), "yaw_deg": YAW},
            positioned=True,
        )
    }
    title: ClassVar[str] = "Waypoint"
    stem: ClassVar[str] = "point"

    type: Literal["waypoint"]
    hold_s: Seconds = 0.0
    acceptance_radius_m: RadiusM | None = None
    speed_m_s: SpeedMS | None = None

    def drafts(self, leg: Leg) -> tuple[Draft, ...]:
        here = self.waypoint_draft(self.hold_s, self.acceptance_radius_m)
        return (*speed_drafts(self.speed_m_s, leg.vehicle_type), here)

    def effort(self, predictor: Predictor[T]) -> T:
        return predictor.fly(self.hold_s, self.acceptance_radius_m)

    def hovers_s(self) -> float:
        return self.hold_s

    def asked_speed_m_s(self) -> float | None:
        return self.speed_m_s

    def reach_m(self) -> float | None:
        return self.acceptance_radius_m

    def holds(self) -> bool:
        return True
