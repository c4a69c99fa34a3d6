"""PX4, from v1.13 on."""

from __future__ import annotations

from collections.abc import Mapping

from app.domain.autopilot.px4 import parameters
from app.domain.autopilot.px4.behaviour import Px4Behaviour
from app.domain.vehicle import VehicleFacts, VehicleType


class Px4:
    """See Autopilot."""

    def behaviour(self, facts: VehicleFacts) -> Px4Behaviour:
        return Px4Behaviour(facts)

    def defaults(self, vehicle_type: VehicleType) -> Mapping[str, float | int]:
        return parameters.DEFAULTS[vehicle_type]
