"""PX4, from v1.13 on."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Final

from app.domain.autopilot.base import Audit, GripperChannel
from app.domain.autopilot.px4 import audit, gripper, modes, parameters, setpoints
from app.domain.autopilot.px4.behaviour import Px4Behaviour
from app.domain.setpoint.capability import FirmwareProfile
from app.domain.vehicle import FirmwareVersion, FlightMode, VehicleFacts, VehicleType


class Px4:
    """See Autopilot."""

    mav_autopilot: Final = 12
    system_id_name: Final = "MAV_SYS_ID"
    gripper_hint: Final = "PD_GRIPPER_TYPE must be 0 or more, and the gripper's output assigned (PWM_MAIN_FUNCn = 430)"
    unattended: Final[Mapping[str, float | int]] = {"COM_OBL_RC_ACT": 5, "COM_LOW_BAT_ACT": 3}
    setpoints: Final = setpoints.TABLE

    def arming_obstacle(self, mode: FlightMode) -> str:
        return modes.arming_obstacle(mode)

    def return_parameters(self, vehicle_type: VehicleType) -> tuple[str, ...]:
        approach = ("RTL_APPR_FORCE",) if vehicle_type is VehicleType.VTOL else ()
        return ("RTL_TYPE", "RTL_LAND_DELAY", *approach)

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

    def parameters(self, vehicle_type: VehicleType) -> tuple[str, ...]:
        return (*parameters.DEFAULTS[vehicle_type], *parameters.ALSO_READ, *gripper.function_parameters())

    def gripper_channel(self, parameters: Mapping[str, float | int]) -> GripperChannel | None:
        return gripper.gripper_channel(parameters)

    def gripper_limits(self, parameters: Mapping[str, float | int]) -> tuple[str, ...]:
        return gripper.limit_parameters(parameters)

    def has_gripper_output(self, parameters: Mapping[str, float | int], unanswered: Collection[str]) -> bool | None:
        return gripper.is_assigned(parameters, unanswered)
