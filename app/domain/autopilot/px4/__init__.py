"""PX4, from v1.13 on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from app.domain.autopilot.base import Audit
from app.domain.autopilot.px4 import audit, parameters, setpoints
from app.domain.autopilot.px4.behaviour import Px4Behaviour
from app.domain.setpoint.capability import FirmwareProfile
from app.domain.vehicle import FirmwareVersion, VehicleFacts, VehicleType


class Px4:
    """See Autopilot."""

    setpoints: Final = setpoints.TABLE

    def setpoint_profile(self, firmware: FirmwareVersion | None) -> FirmwareProfile:
        return setpoints.firmware_profile(firmware)

    def audit(self, *, commanded: bool) -> Audit:
        if commanded:
            return Audit(audit.AUDITED_COMMANDED, audit.commanded_entry)
        return Audit(audit.AUDITED, audit.entry)

    def behaviour(self, facts: VehicleFacts) -> Px4Behaviour:
        return Px4Behaviour(facts)

    def defaults(self, vehicle_type: VehicleType) -> Mapping[str, float | int]:
        return parameters.DEFAULTS[vehicle_type]
