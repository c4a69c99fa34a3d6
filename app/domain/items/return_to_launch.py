"""Return to launch."""

from __future__ import annotations

from typing import ClassVar, Literal

from app.domain.geo import LatLon
from app.domain.items.base import CommandForm, Draft, Forms, Item, Leg, Predictor, T, command_draft
from app.domain.mission import MavCmd
from app.domain.vehicle.state import FlightRegime, GlobalPosition, VehicleType


class ReturnToLaunch(Item):
    """Fly home and land there, by the vehicle's RTL settings. Ends the plan."""

    forms: ClassVar[Forms] = {MavCmd.NAV_RETURN_TO_LAUNCH: CommandForm("return_to_launch", {})}
    moves: ClassVar[bool] = True
    lands: ClassVar[bool] = True
    goes_home: ClassVar[bool] = True
    title: ClassVar[str] = "Return to launch"
    stem: ClassVar[str] = "home"

    type: Literal["return_to_launch"]

    def end_of(self, home: GlobalPosition, here: LatLon) -> LatLon:
        return LatLon(home.latitude_deg, home.longitude_deg, 0.0)

    def carried_after(self, vehicle_type: VehicleType, before: FlightRegime) -> FlightRegime:
        return before if before is FlightRegime.WHEELS else FlightRegime.GROUND

    def drafts(self, leg: Leg) -> tuple[Draft, ...]:
        return (command_draft(MavCmd.NAV_RETURN_TO_LAUNCH),)

    def effort(self, predictor: Predictor[T]) -> T:
        return predictor.return_home()
