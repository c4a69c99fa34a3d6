"""Where the simulator is known to differ from the recordings, each with its reason. Nothing else may differ."""

from __future__ import annotations

import re
from dataclasses import dataclass
from fnmatch import fnmatch


@dataclass(frozen=True, slots=True)
class Known:
    """`scenario` and `aspect` are shell patterns, `what` a regular expression found in the difference's text."""

    scenario: str
    aspect: str
    what: str
    reason: str

    def covers(self, scenario: str, aspect: str, what: str) -> bool:
        """Whether this difference is the known one."""
        return (
            fnmatch(scenario, self.scenario) and fnmatch(aspect, self.aspect) and re.search(self.what, what) is not None
        )


_ORBIT = "DO_ORBIT is not simulated (Waydrop never commands it), so the mission in progress goes on"
_TURNS = (
    "PX4 swings out at a waypoint and is up to 2 s slower in the leg after it than the model, which cuts the corner: "
    "it is elsewhere when the ground side acts, and reaches the next item at another time"
)
_SEVEN_DIGITS = (
    "the recording keeps seven digits of a MISSION_ITEM's float latitude, so that the replayed mission is another"
)
_LAST_HEARTBEAT = (
    "the landing comes 4 s later after a flight of 150 s, so the recording's last heartbeat falls before the disarming "
    "instead of after it"
)
_FLIPS = (
    "at 0.8 setpoints a second the vehicle changes between RTL and OFFBOARD all the time; which of the changes a "
    "heartbeat a second shows is chance"
)
_LATE_FAILSAFE = (
    "PX4 looks for the lost stream up to 0.13 s later than after COM_OF_LOSS_T, and the ground side sends a refused "
    "setpoint each 0.05 s: one or more of its texts come before instead of after"
)
_BOTH_AT_ONCE = (
    "the ground side changes COM_OBL_RC_ACT and streams again in the same moment; PX4 acts on the parameter for 0.2 s "
    "before it goes on in OFFBOARD"
)
_ROVER_RETURN = "a returning PX4 rover lands from the start of its way home, the simulated one when it has arrived"

KNOWN: tuple[Known, ...] = (
    Known(
        "03b_upload_protocol",
        "mission protocol",
        r"^recorded MISSION_ACK type 0 mission_type 0 opaque_id 943885599 .*; simulated MISSION_ACK type 0",
        _SEVEN_DIGITS,
    ),
    Known("03b_upload_protocol", "stored mission", "^recorded 2 items, id 943885599", _SEVEN_DIGITS),
    Known(
        "05_fence_rally",
        "status texts",
        "^missing: RTL destination breaches geofence",
        "the vehicle plans its way home only when it returns, and without looking at the fence",
    ),
    Known("15_hot_swap", "current mission item", r"^extra: 1 at .* s, 0 at .* s$", _TURNS),
    Known("15_hot_swap", "current mission item: times", "^[01] after", _TURNS),
    Known("16_pause_resume_jump", "current mission item", r"^extra: 2 at [\d.]+ s$", _TURNS),
    Known("16_pause_resume_jump", "mission items reached: times", "^5 after", _TURNS),
    Known("16_pause_resume_jump", "current mission item: times", "^5 after 4", _TURNS),
    Known("16_pause_resume_jump", "mission_state: times", "^5 after", _TURNS),
    Known("16_pause_resume_jump", "landed_state: times", "^4 after", _TURNS),
    Known("16_pause_resume_jump", "mode and arming: times", "^mode 4.5 armed after", _TURNS),
    Known(
        "17_gripper_commands",
        "command acks: times",
        r"command 211 result 5 .*: 0\.12 s, simulated",
        "two of the twenty recorded IN_PROGRESS acks took 0.12 s, all others 0.01 s",
    ),
    Known(
        "17_gripper_commands",
        "parameters: times",
        "^PARAM_VALUE param_id PD_GRIPPER_TYPE .*: 4 times, simulated 2",
        "PX4 sometimes answers PARAM_SET twice",
    ),
    Known("18_offboard_quad", "mode and arming", r"^extra: mode 6\.0 armed at", _FLIPS),
    Known("18_offboard_quad", "mode and arming: times", r"^mode (4\.5|6\.0) armed after the ground's act", _FLIPS),
    Known("19_offboard_global_attitude", "status texts", "^(extra|missing): Failsafe activated", _LATE_FAILSAFE),
    Known(
        "19_offboard_global_attitude", "events", "^(extra|missing): commander_failsafe_enter_generic", _LATE_FAILSAFE
    ),
    Known("20_offboard_plane", "status texts", "^missing: Failsafe activated at .*, RTL: start return", _BOTH_AT_ONCE),
    Known("20_offboard_plane", "events", "^missing: commander_failsafe_enter_generic at .*, vrtl", _BOTH_AT_ONCE),
    Known("21_offboard_rover", "landed_state", r"^missing: 4 at", _ROVER_RETURN),
    Known("21_offboard_rover", "status texts", "^(missing|extra): RTL: land at destination", _ROVER_RETURN),
    Known("21_offboard_rover", "events", "^(missing|extra): rtl_land_at_destination", _ROVER_RETURN),
    Known("22_reposition_*", "command acks", "^recorded COMMAND_ACK command 34 result 0", _ORBIT),
    Known("22_reposition_quad", "mission items reached", "^extra: 0 at .*, 1 at", _ORBIT),
    Known("22_reposition_quad", "current mission item", "^extra: 1 at .*, 2 at", _ORBIT),
    Known("22_reposition_quad", "mission_state", "^recorded 2 at .*; simulated 4 at", _ORBIT),
    Known("22_reposition_quad", "mode and arming", "^missing: mode 3.1 armed", _ORBIT),
    Known("23_reboot_midflight", "current mission item: times", "^3 after 2", _TURNS),
    Known("24_link_loss", "status texts", "Disarmed by landing", _LAST_HEARTBEAT),
    Known("24_link_loss", "events", "commander_disarmed_by", _LAST_HEARTBEAT),
)
