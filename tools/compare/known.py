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
_CHECK_PHASE = (
    "PX4 looks for the lost stream ten times a second, at moments that are chance, and the ground side sends a refused "
    "setpoint each 0.05 s: one of its texts comes after the failsafe instead of before"
)

_TWO_SLOTS = (
    "MISSION_CURRENT comes in slots of a second, so that both ends of the time are seen up to a second late; what the "
    "items reached and the commands show of the same moments agrees"
)

_ENERGY = (
    "how TECS trades speed for height is not modelled: a steep descent and its end are up to 4 m above or below, and "
    "so is a VTOL right after its transition"
)
_BOBBING = (
    "at 5 m/s the wing of a hovering VTOL is at its stall and PX4's height swings by 2.5 m; the phase of that is chance"
)

_SWING = (
    "PX4's height swings by 1 m in fast flight, and a waypoint counts as reached within 0.8 m of it: at which swing is "
    "chance, and the second flight of this leg in the same recording ends 5 m sooner too"
)
_ORDER = (
    "whether the navigator says that the mission is finished before the commander says that it has landed is chance: "
    "the third landing of the same recording has the other order"
)

_HASH = (
    "_HASH_CHECK covers the names and values of all parameters in use, and a simulated vehicle has a tenth of PX4's; "
    "that it changes, and goes back, with what the ground side sets is tested"
)
KNOWN: tuple[Known, ...] = (
    Known("28b_param_hash", "parameters", "^recorded PARAM_VALUE param_id _HASH_CHECK", _HASH),
    Known(
        "01_connect_gcs",
        "events",
        r"^missing: commander_failsafe_enter_generic_warn at 0\.0 s$",
        "whether a link hears what is said in the moment of power-up is chance: one recording alone has it",
    ),
    Known(
        "14_infeasible_plane",
        "events",
        "^missing: commander_failsafe_enter_generic_warn at ",
        "the motors were cut in the climb; how the plane tumbles then, and that its attitude fails, is not modelled",
    ),
    Known(
        "03b_upload_protocol",
        "*mission*",
        r"^recorded (MISSION_ACK type 0 .* opaque_id 943885599 .*; simulated MISSION_ACK type 0|2 items, id 943885599)",
        _SEVEN_DIGITS,
    ),
    Known(
        "14_infeasible_plane",
        "home position",
        "^[0-9.]+ m apart, after a move",
        "the motors are cut in the climb, and how a plane falls then is not modelled",
    ),
    Known("[12][015]_*plane*", "track", r"^(2 to 3|4 to 5|5 to 6), flight 1: 3\.\d m apart in height", _ENERGY),
    Known("[12][257]_*vtol*", "track", r"^\d+ to \d+, flight 1: [23]\.\d m apart in height", _ENERGY),
    Known("25_land_detector_plane", "home position", r"^4\.\d m apart, after a move", _ENERGY),
    Known("27_vtol_transitions", "track", r"^14 to 15, flight 1: 4\.\d m apart in height", _BOBBING),
    Known("09_quad_land_deliver", "track", r"^(0 to 1|1 to 3), flight 1: 5\.\d m apart on a leg", _SWING),
    Known("09_quad_land_deliver", "*ts", r"^(missing|extra): ([Mm]ission[_ ][Ff]inished)(, landed)? at 17\d\.", _ORDER),
    Known("25_land_detector_quad", "current mission item: times", "^2 after 1: 5.04 s", _TWO_SLOTS),
    Known(
        "17_gripper_commands",
        "command acks: times",
        r"command 211 result 5 .*: 0\.12 s, simulated",
        "two of the twenty recorded IN_PROGRESS acks took 0.12 s, all others 0.01 s",
    ),
    Known(
        "18_offboard_quad",
        "mode and arming*",
        r"^(extra: mode 6\.0 armed at|mode (4\.5|6\.0) armed after the ground's act)",
        _FLIPS,
    ),
    Known(
        "19_offboard_global_attitude",
        "*ts",
        "^(extra|missing): (SET_POSITION_TARGET_GLOBAL_INT invalid coordinate frame 3"
        "|mavlink_rcv_sp_target_gl_invalid_coord) at [0-9.]+ s$",
        _CHECK_PHASE,
    ),
)
