"""PX4, from v1.13 on."""

from __future__ import annotations

from typing import Final

from app.domain.autopilot.base import Audit, Autopilot
from app.domain.autopilot.px4 import audit, gripper, modes, parameters, setpoints, settings
from app.domain.autopilot.px4.behaviour import Px4Behaviour

PX4: Final = Autopilot(
    name="PX4",
    mav_autopilot=12,
    behaviour=Px4Behaviour,
    defaults=parameters.DEFAULTS,
    also_read=(*parameters.ALSO_READ, *gripper.function_parameters()),
    return_parameters=settings.return_parameters,
    unattended={"COM_OBL_RC_ACT": 5, "COM_LOW_BAT_ACT": 3},
    system_id_name="MAV_SYS_ID",
    flight_mode=modes.flight_mode,
    mode_numbers=modes.mode_numbers,
    arming_obstacle=modes.arming_obstacle,
    setpoints=setpoints.TABLE,
    setpoint_profile=setpoints.firmware_profile,
    audit=Audit(audit.AUDITED, audit.entry),
    audit_commanded=Audit(audit.AUDITED_COMMANDED, audit.commanded_entry),
    gripper_channel=gripper.gripper_channel,
    gripper_limits=gripper.limit_parameters,
    has_gripper_output=gripper.is_assigned,
    takes_turns=False,
    takes_instance=False,
    executes_winch=False,
    commands_winch=False,
    usually_stored={"max_mission_items": 500, "max_fence_items": 64, "max_rally_points": 32},
    gripper_hint="PD_GRIPPER_TYPE must be 0 or more, and the gripper's output assigned (PWM_MAIN_FUNCn = 430)",
)
"""See Autopilot."""
