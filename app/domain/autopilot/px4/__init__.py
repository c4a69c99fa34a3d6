"""PX4, v1.13 and later."""

from __future__ import annotations

from typing import Final

from app.domain.autopilot.base import Audit, Autopilot
from app.domain.autopilot.px4 import gripper, modes, offboard, parameters
from app.domain.autopilot.px4.behaviour import Px4Behaviour

PX4: Final = Autopilot(
    name="PX4",
    mav_autopilot=12,
    behaviour=Px4Behaviour,
    defaults=parameters.DEFAULTS,
    also_read=(*parameters.ALSO_READ, *gripper.function_parameters()),
    return_parameters=parameters.return_parameters,
    unattended={"COM_OBL_RC_ACT": 5, "COM_LOW_BAT_ACT": 3},
    system_id_name="MAV_SYS_ID",
    flight_mode=modes.flight_mode,
    mode_numbers=modes.mode_numbers,
    arming_obstacle=modes.arming_obstacle,
    setpoints=offboard.TABLE,
    setpoint_profile=offboard.firmware_profile,
    audit=Audit(offboard.AUDITED, offboard.entry, offboard.MERGED),
    audit_commanded=Audit(offboard.AUDITED_COMMANDED, offboard.commanded_entry, offboard.MERGED),
    gripper_channel=gripper.gripper_channel,
    gripper_limits=gripper.limit_parameters,
    has_gripper_output=gripper.is_assigned,
    takes_turns=False,
    takes_instance=False,
    executes_winch=False,
    commands_winch=False,
    usually_stored={"max_mission_items": 500, "max_fence_items": 64, "max_rally_points": 32},
    gripper_hint="PD_GRIPPER_TYPE must be 0 or more, and the gripper output assigned (PWM_MAIN_FUNCn = 430)",
)
"""See Autopilot."""
