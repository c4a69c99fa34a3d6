"""Fly home."""

from __future__ import annotations

from typing import ClassVar, Literal

from app.domain.carried import Carried
from app.domain.geo import Place
from app.domain.items.base import Item, Site, T, Way
from app.domain.items.draft import Draft, command_draft
from app.domain.items.form import CommandForm, Forms
from app.domain.mission import MavCmd
from app.domain.vehicle import GlobalPosition, VehicleType


class ReturnToLaunch(Item):
    """Fly home and land there, by the vehicle's own RTL settings. Ends the plan."""

    forms: ClassVar[Forms] = {MavCmd.NAV_RETURN_TO_LAUNCH: CommandForm("return_to_launch", {})}
    moves: ClassVar[bool] = True
    lands: ClassVar[bool] = True
    goes_home: ClassVar[bool] = True
    title: ClassVar[str] = "Return to launch"
    stem: ClassVar[str] = "home"

    type: Literal["return_to_launch"]

    def end_of(self, home: GlobalPosition, here: Place) -> Place:
        return Place(home.latitude_deg, home.longitude_deg, 0.0)

    def carried_after(self, vehicle_type: VehicleType, before: Carried) -> Carried:
        return before if before is Carried.WHEELS else Carried.GROUND

    def drafts(self, site: Site) -> tuple[Draft, ...]:
        return (command_draft(MavCmd.NAV_RETURN_TO_LAUNCH),)

    def effort(self, way: Way[T]) -> T:
        return way.return_home()
