"""Land."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Literal

from app.domain.items.base import (
    YAW,
    CommandForm,
    Draft,
    Forms,
    Leg,
    Predictor,
    T,
    command_draft,
    or_nan,
    position_draft,
)
from app.domain.items.fields import Altitude
from app.domain.items.landing_pattern import Approach, landing_pattern
from app.domain.items.waypoint import Stop
from app.domain.mission import MavCmd
from app.domain.vehicle.state import FlightRegime, VehicleType

_TANGENT_EXIT = 1.0


class Land(Stop):
    """Land at a position. The altitude is that of the ground there.

    Within the plan, a rotary wing stays armed and the next position item takes off again. `approach` is for fixed
    wings; null computes one in line with the preceding item.
    """

    forms: ClassVar[Forms] = {
        MavCmd.NAV_LAND: CommandForm("land", {"yaw_deg": YAW}, positioned=True),
        MavCmd.NAV_VTOL_LAND: CommandForm("land", {"yaw_deg": YAW}, positioned=True),
    }
    lands: ClassVar[bool] = True
    title: ClassVar[str] = "Land"
    fresh: ClassVar[Mapping[str, object]] = {"relative_altitude_m": 0}

    type: Literal["land"]
    approach: Approach | None = None

    def carried_after(self, vehicle_type: VehicleType, before: FlightRegime) -> FlightRegime:
        return before if before is FlightRegime.WHEELS else FlightRegime.GROUND

    def command(self, vehicle_type: VehicleType) -> MavCmd:
        return MavCmd.NAV_VTOL_LAND if vehicle_type is VehicleType.VTOL else MavCmd.NAV_LAND

    def drafts(self, leg: Leg) -> tuple[Draft, ...]:
        params = (0.0, 0.0, 0.0, or_nan(self.yaw_deg))
        landing = position_draft(self.command(leg.vehicle_type), self, leg.end, params)
        if leg.vehicle_type is not VehicleType.FIXED_WING:
            return (landing,)
        return (command_draft(MavCmd.DO_LAND_START), self._circle_draft(leg), landing)

    def _circle_draft(self, leg: Leg) -> Draft:
        """LOITER_TO_ALT towards the next item (heading required), left on the tangent."""
        pattern = landing_pattern(self, self.approach, leg.start, leg.home, leg.facts)
        altitude: Altitude = self.approach or self
        height_m = pattern.circle.relative_altitude_m
        if altitude.absolute_altitude_m is None:
            given = Altitude(relative_altitude_m=height_m)
        else:
            given = Altitude(absolute_altitude_m=height_m + leg.home.altitude_m)
        params = (1.0, pattern.radius_m, 0.0, _TANGENT_EXIT)
        return position_draft(MavCmd.NAV_LOITER_TO_ALT, given, pattern.circle, params)

    def effort(self, predictor: Predictor[T]) -> T:
        return predictor.land(self, self.approach)
