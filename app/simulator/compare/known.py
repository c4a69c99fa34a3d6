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


_SEVEN_DIGITS = (
    "the recording keeps seven digits of a MISSION_ITEM's float latitude, so that the replayed mission is another"
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

KNOWN: tuple[Known, ...] = (
    Known(
        "03b_upload_protocol",
        "mission protocol",
        r"^recorded MISSION_ACK type 0 mission_type 0 opaque_id 943885599 .*; simulated MISSION_ACK type 0",
        _SEVEN_DIGITS,
    ),
    Known("03b_upload_protocol", "stored mission", "^recorded 2 items, id 943885599", _SEVEN_DIGITS),
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
)
