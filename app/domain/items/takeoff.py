"""Take off."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Final, Literal, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from app.domain.geo import LatLon
from app.domain.items.base import YAW, CommandForm, Draft, Forms, Item, Leg, Param, Predictor, T, or_nan, position_draft
from app.domain.items.fields import Altitude, LatitudeDeg, LongitudeDeg, Point, YawDeg, relative_altitude_m
from app.domain.mission import MavCmd
from app.domain.vehicle.state import IN_AIR, FlightRegime, GlobalPosition, VehicleType

WING_PITCH_DEG: Final = 15.0
"""Default pitch of a fixed wing's climb."""


class Takeoff(Item, Altitude):
    """Climb to an altitude. Without a position, climb above home. A fixed wing climbs towards the position.

    `pitch_deg` is the minimum pitch of a fixed wing's climb (param1 of NAV_TAKEOFF).
    """

    forms: ClassVar[Forms] = {
        MavCmd.NAV_TAKEOFF: CommandForm("takeoff", {"pitch_deg": Param(1), "yaw_deg": YAW}, positioned=True),
        MavCmd.NAV_VTOL_TAKEOFF: CommandForm("takeoff", {"yaw_deg": YAW}, positioned=True),
    }
    moves: ClassVar[bool] = True
    flies: ClassVar[bool] = True
    takes_off: ClassVar[bool] = True
    title: ClassVar[str] = "Take off"

    type: Literal["takeoff"]
    latitude_deg: LatitudeDeg | None = None
    longitude_deg: LongitudeDeg | None = None
    yaw_deg: YawDeg | None = None
    pitch_deg: Annotated[float, Field(ge=0, le=45)] | None = None

    @model_validator(mode="after")
    def _both_coordinates(self) -> Self:
        if (self.latitude_deg is None) != (self.longitude_deg is None):
            raise PydanticCustomError("half_position", "specify both latitude_deg and longitude_deg, or neither")
        return self

    def altitude(self) -> Altitude:
        return self

    def point(self) -> Point | None:
        if self.latitude_deg is None or self.longitude_deg is None:
            return None
        return Point(latitude_deg=self.latitude_deg, longitude_deg=self.longitude_deg)

    def end_of(self, home: GlobalPosition, here: LatLon) -> LatLon:
        latitude_deg = home.latitude_deg if self.latitude_deg is None else self.latitude_deg
        longitude_deg = home.longitude_deg if self.longitude_deg is None else self.longitude_deg
        return LatLon(latitude_deg, longitude_deg, relative_altitude_m(self, home))

    def carried_after(self, vehicle_type: VehicleType, before: FlightRegime) -> FlightRegime:
        # NAV_VTOL_TAKEOFF includes a transition
        return FlightRegime.FIXED_WING if vehicle_type is VehicleType.VTOL else IN_AIR[vehicle_type]

    def drafts(self, leg: Leg) -> tuple[Draft, ...]:
        climb = 0.0 if leg.vehicle_type is VehicleType.VTOL else self.climb_pitch_deg(leg.vehicle_type)
        params = (climb, 0.0, 0.0, or_nan(self.yaw_deg))
        return (position_draft(self.command(leg.vehicle_type), self, leg.end, params),)

    def command(self, vehicle_type: VehicleType) -> MavCmd:
        return MavCmd.NAV_VTOL_TAKEOFF if vehicle_type is VehicleType.VTOL else MavCmd.NAV_TAKEOFF

    def written_fields(self, vehicle_type: VehicleType, home: GlobalPosition) -> Mapping[str, float]:
        fields = {} if self.pitch_deg is not None else {"pitch_deg": self.climb_pitch_deg(vehicle_type)}
        if self.latitude_deg is None:
            fields |= {"latitude_deg": home.latitude_deg, "longitude_deg": home.longitude_deg}
        return fields

    def climb_pitch_deg(self, vehicle_type: VehicleType) -> float:
        """Return the pitch, or the default of a fixed wing."""
        if self.pitch_deg is not None:
            return self.pitch_deg
        return WING_PITCH_DEG if vehicle_type is VehicleType.FIXED_WING else 0.0

    def effort(self, predictor: Predictor[T]) -> T:
        return predictor.take_off()
