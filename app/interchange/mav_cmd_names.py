"""Names of MAV_CMD values that files have and plans do not, so that a finding can call them by their name."""

from __future__ import annotations

from typing import Final

from app.domain.mission import MavCmd

_CAMERA: Final = {
    195: "DO_SET_ROI_LOCATION",
    196: "DO_SET_ROI_WPNEXT_OFFSET",
    197: "DO_SET_ROI_NONE",
    198: "DO_SET_ROI_SYSID",
    201: "DO_SET_ROI",
    202: "DO_DIGICAM_CONFIGURE",
    203: "DO_DIGICAM_CONTROL",
    204: "DO_MOUNT_CONFIGURE",
    205: "DO_MOUNT_CONTROL",
    206: "DO_SET_CAM_TRIGG_DIST",
    214: "DO_SET_CAM_TRIGG_INTERVAL",
    530: "SET_CAMERA_MODE",
    531: "SET_CAMERA_ZOOM",
    532: "SET_CAMERA_FOCUS",
    534: "SET_CAMERA_SOURCE",
    1000: "DO_GIMBAL_MANAGER_PITCHYAW",
    1001: "DO_GIMBAL_MANAGER_CONFIGURE",
    2000: "IMAGE_START_CAPTURE",
    2001: "IMAGE_STOP_CAPTURE",
    2003: "DO_TRIGGER_CONTROL",
    2500: "VIDEO_START_CAPTURE",
    2501: "VIDEO_STOP_CAPTURE",
}
_OTHERS: Final = {
    80: "NAV_ROI",
    81: "NAV_PATHPLANNING",
    82: "NAV_SPLINE_WAYPOINT",
    92: "NAV_GUIDED_ENABLE",
    94: "NAV_PAYLOAD_PLACE",
    95: "NAV_LAST",
    112: "CONDITION_DELAY",
    113: "CONDITION_CHANGE_ALT",
    114: "CONDITION_DISTANCE",
    115: "CONDITION_YAW",
    179: "DO_SET_HOME",
    181: "DO_SET_RELAY",
    182: "DO_REPEAT_RELAY",
    183: "DO_SET_SERVO",
    184: "DO_REPEAT_SERVO",
    187: "DO_SET_ACTUATOR",
    191: "DO_GO_AROUND",
    207: "DO_FENCE_ENABLE",
    208: "DO_PARACHUTE",
    210: "DO_INVERTED_FLIGHT",
    212: "DO_AUTOTUNE_ENABLE",
    213: "NAV_SET_YAW_SPEED",
    218: "DO_AUX_FUNCTION",
    222: "DO_GUIDED_LIMITS",
    223: "DO_ENGINE_CONTROL",
    260: "OBLIQUE_SURVEY",
    4501: "CONDITION_GATE",
    30001: "PAYLOAD_PREPARE_DEPLOY",
    30002: "PAYLOAD_CONTROL_DEPLOY",
}
_OURS: Final = {int(command): command.name for command in MavCmd}
CAMERA_ONLY: Final = frozenset(_CAMERA)
"""Commands for a camera or a gimbal: without them the flight and its drops are the same."""

HINTS: Final = {
    80: "Waydrop has no camera items; take it away",
    94: "use a land item with a gripper item after it",
    112: "use NAV_DELAY, which a plan has as its delay item",
    183: "Waydrop drops with DO_GRIPPER or DO_WINCH, whose outcome it can tell",
    187: "Waydrop drops with DO_GRIPPER or DO_WINCH, whose outcome it can tell",
    30002: "Waydrop drops with DO_GRIPPER or DO_WINCH, whose outcome it can tell",
}


def command_name(command: int) -> str:
    """`NAV_WAYPOINT (16)`, or the bare number of one that is not known."""
    name = _CAMERA.get(command) or _OTHERS.get(command) or _OURS.get(command)
    return f"{name} ({command})" if name else f"the command {command}"
