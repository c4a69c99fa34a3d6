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

_PLANE_STOPS = "flare and roll-out of a plane are kinematic: it stops ten to twenty metres before the recorded one"
_TWO_SLOTS = (
    "MISSION_CURRENT comes in slots of a second, so that both ends of the time are seen up to a second late; what the "
    "items reached and the commands show of the same moments agrees"
)

_PLANE_TURNS = (
    "turns and descents on the wing are kinematic: up to 40 m beside and 10 m above the recorded approach of a plane, "
    "and 3 m above or below a VTOL that changes its state"
)

_HASH = (
    "_HASH_CHECK covers the names and values of all parameters in use, and a simulated vehicle has a tenth of PX4's; "
    "that it changes, and goes back, with what the ground side sets is tested"
)
_LINKS_ORDER = (
    "PX4 tells a change or a text by each link's own task, 5 to 25 ms later; which of two links is the first is chance"
)

KNOWN: tuple[Known, ...] = (
    Known("28_param_changed", "status texts", "on gcs: Disarmed by external command at", _LINKS_ORDER),
    Known("28b_param_hash", "parameters", "^recorded PARAM_VALUE param_id _HASH_CHECK", _HASH),
    Known(
        "28_param_changed",
        "parameters",
        "^(extra|missing): PARAM_VALUE param_id [A-Z_0-9]+ .* at [0-9.]+ s$",
        _LINKS_ORDER,
    ),
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
        "mission protocol",
        r"^recorded MISSION_ACK type 0 mission_type 0 opaque_id 943885599 .*; simulated MISSION_ACK type 0",
        _SEVEN_DIGITS,
    ),
    Known("03b_upload_protocol", "stored mission", "^recorded 2 items, id 943885599", _SEVEN_DIGITS),
    Known("10_plane_delivery", "home position", "^[0-9.]+ m apart, after a move", _PLANE_STOPS),
    Known("12_vtol_delivery", "current mission item: times", "^7 after 6: 5.05 s", _TWO_SLOTS),
    Known(
        "14_infeasible_plane",
        "home position",
        "^[0-9.]+ m apart, after a move",
        "the motors are cut in the climb, and how a plane falls then is not modelled",
    ),
    Known("10_plane_delivery", "track", "^(4 to 5|5 to 6), ", _PLANE_TURNS),
    Known("12_vtol_delivery", "track", "^6 to 7, .* in height", _PLANE_TURNS),
    Known("25_land_detector_plane", "track", "^2 to 3, ", _PLANE_TURNS),
    Known("25_land_detector_plane", "track", "^3 to 4, ", _PLANE_STOPS),
    Known("25_land_detector_vtol", "track", "^0 to 1, .* in height", _PLANE_TURNS),
    Known("25_land_detector_plane", "home position", "^[0-9.]+ m apart, after a move", _PLANE_STOPS),
    Known("25_land_detector_quad", "current mission item: times", "^2 after 1: 5.04 s", _TWO_SLOTS),
    Known(
        "17_gripper_commands",
        "command acks: times",
        r"command 211 result 5 .*: 0\.12 s, simulated",
        "two of the twenty recorded IN_PROGRESS acks took 0.12 s, all others 0.01 s",
    ),
    Known("18_offboard_quad", "mode and arming", r"^extra: mode 6\.0 armed at", _FLIPS),
    Known("18_offboard_quad", "mode and arming: times", r"^mode (4\.5|6\.0) armed after the ground's act", _FLIPS),
    Known(
        "19_offboard_global_attitude",
        "status texts",
        "^(extra|missing): SET_POSITION_TARGET_GLOBAL_INT invalid coordinate frame 3 at [0-9.]+ s$",
        _CHECK_PHASE,
    ),
    Known(
        "19_offboard_global_attitude",
        "events",
        "^(extra|missing): mavlink_rcv_sp_target_gl_invalid_coord at [0-9.]+ s$",
        _CHECK_PHASE,
    ),
)
