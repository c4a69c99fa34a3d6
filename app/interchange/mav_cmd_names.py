"""What a finding says of the commands that files have and plans do not."""

from __future__ import annotations

from typing import Final

from app.domain.mission import MavCmd

CAMERA_ONLY: Final = frozenset(
    {
        MavCmd.DO_SET_ROI_LOCATION,
        MavCmd.DO_SET_ROI_WPNEXT_OFFSET,
        MavCmd.DO_SET_ROI_NONE,
        MavCmd.DO_SET_ROI_SYSID,
        MavCmd.DO_SET_ROI,
        MavCmd.DO_DIGICAM_CONFIGURE,
        MavCmd.DO_DIGICAM_CONTROL,
        MavCmd.DO_MOUNT_CONFIGURE,
        MavCmd.DO_MOUNT_CONTROL,
        MavCmd.DO_SET_CAM_TRIGG_DIST,
        MavCmd.DO_SET_CAM_TRIGG_INTERVAL,
        MavCmd.SET_CAMERA_MODE,
        MavCmd.SET_CAMERA_ZOOM,
        MavCmd.SET_CAMERA_FOCUS,
        MavCmd.SET_CAMERA_SOURCE,
        MavCmd.DO_GIMBAL_MANAGER_PITCHYAW,
        MavCmd.DO_GIMBAL_MANAGER_CONFIGURE,
        MavCmd.IMAGE_START_CAPTURE,
        MavCmd.IMAGE_STOP_CAPTURE,
        MavCmd.DO_TRIGGER_CONTROL,
        MavCmd.VIDEO_START_CAPTURE,
        MavCmd.VIDEO_STOP_CAPTURE,
    }
)
"""Commands for a camera or a gimbal: without them the flight and its drops are the same."""

HINTS: Final = {
    80: "Waydrop does not turn cameras; take it away, or use a photo item",
    94: "use a land item with a gripper item after it",
    112: "use NAV_DELAY, which a plan has as its delay item",
    183: "Waydrop drops with DO_GRIPPER or DO_WINCH, whose outcome it can tell",
    187: "Waydrop drops with DO_GRIPPER or DO_WINCH, whose outcome it can tell",
    30002: "Waydrop drops with DO_GRIPPER or DO_WINCH, whose outcome it can tell",
}


def command_name(command: int) -> str:
    """`NAV_WAYPOINT (16)`, or the bare number of one that is not known."""
    try:
        return f"{MavCmd(command).name} ({command})"
    except ValueError:
        return f"the command {command}"
