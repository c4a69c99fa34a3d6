"""MAVLink and PX4 numbers that the simulated vehicles use.

Written from MAVLink's common.xml and PX4's px4_custom_mode.h, on purpose not shared with the rest of Waydrop: the
vehicles must be able to contradict the ground side.
"""

from __future__ import annotations

from enum import IntEnum

VEHICLE_COMPONENT = 1
GRIPPER_FUNCTION = 430
"""PWM_MAIN_FUNCn of the gripper's output."""


class Cmd(IntEnum):
    """MAV_CMD."""

    IDLE = 0
    """PX4's own: wait where you are."""
    NAV_WAYPOINT = 16
    NAV_LOITER_UNLIM = 17
    NAV_LOITER_TURNS = 18
    NAV_LOITER_TIME = 19
    NAV_RETURN_TO_LAUNCH = 20
    NAV_LAND = 21
    NAV_TAKEOFF = 22
    NAV_LOITER_TO_ALT = 31
    DO_ORBIT = 34
    NAV_ROI = 80
    NAV_VTOL_TAKEOFF = 84
    NAV_VTOL_LAND = 85
    NAV_DELAY = 93
    DO_SET_MODE = 176
    DO_JUMP = 177
    DO_CHANGE_SPEED = 178
    DO_SET_HOME = 179
    DO_FLIGHTTERMINATION = 185
    DO_LAND_START = 189
    DO_REPOSITION = 192
    DO_PAUSE_CONTINUE = 193
    DO_SET_ROI = 201
    DO_DIGICAM_CONTROL = 203
    DO_GRIPPER = 211
    DO_SET_MISSION_CURRENT = 224
    PREFLIGHT_REBOOT_SHUTDOWN = 246
    MISSION_START = 300
    COMPONENT_ARM_DISARM = 400
    GET_MESSAGE_INTERVAL = 510
    SET_MESSAGE_INTERVAL = 511
    REQUEST_MESSAGE = 512
    REQUEST_AUTOPILOT_CAPABILITIES = 520
    DO_GIMBAL_MANAGER_PITCHYAW = 1000
    DO_GIMBAL_MANAGER_CONFIGURE = 1001
    IMAGE_START_CAPTURE = 2000
    DO_TRIGGER_CONTROL = 2003
    DO_VTOL_TRANSITION = 3000
    DO_WINCH = 42600


class Result(IntEnum):
    """MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5
    CANCELLED = 6


class MissionAck(IntEnum):
    """MAV_MISSION_RESULT."""

    ACCEPTED = 0
    ERROR = 1
    UNSUPPORTED_FRAME = 2
    UNSUPPORTED = 3
    NO_SPACE = 4
    INVALID = 5
    INVALID_PARAM1 = 6
    INVALID_PARAM2 = 7
    INVALID_PARAM3 = 8
    INVALID_PARAM4 = 9
    INVALID_PARAM5_X = 10
    INVALID_PARAM6_Y = 11
    INVALID_PARAM7 = 12
    INVALID_SEQUENCE = 13
    DENIED = 14
    OPERATION_CANCELLED = 15


class MissionType(IntEnum):
    """MAV_MISSION_TYPE."""

    MISSION = 0
    FENCE = 1
    RALLY = 2
    ALL = 255


class MissionState(IntEnum):
    """MISSION_STATE of MISSION_CURRENT."""

    UNKNOWN = 0
    NO_MISSION = 1
    NOT_STARTED = 2
    ACTIVE = 3
    PAUSED = 4
    COMPLETE = 5


class LandedState(IntEnum):
    """MAV_LANDED_STATE."""

    UNDEFINED = 0
    ON_GROUND = 1
    IN_AIR = 2
    TAKEOFF = 3
    LANDING = 4


class VtolState(IntEnum):
    """MAV_VTOL_STATE."""

    UNDEFINED = 0
    TRANSITION_TO_FW = 1
    TRANSITION_TO_MC = 2
    MC = 3
    FW = 4


class SystemStatus(IntEnum):
    """MAV_STATE."""

    UNINIT = 0
    CALIBRATING = 2
    STANDBY = 3
    ACTIVE = 4
    CRITICAL = 5
    FLIGHT_TERMINATION = 8


class Severity(IntEnum):
    """MAV_SEVERITY."""

    EMERGENCY = 0
    ALERT = 1
    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6


class Mode(IntEnum):
    """A PX4 mode as HEARTBEAT.custom_mode: main mode in byte 2, sub mode in byte 3."""

    MANUAL = 1 << 16
    ALTCTL = 2 << 16
    POSCTL = 3 << 16
    ORBIT = 3 << 16 | 1 << 24
    ACRO = 5 << 16
    OFFBOARD = 6 << 16
    STABILIZED = 7 << 16
    TERMINATION = 10 << 16
    TAKEOFF = 4 << 16 | 2 << 24
    LOITER = 4 << 16 | 3 << 24
    MISSION = 4 << 16 | 4 << 24
    RTL = 4 << 16 | 5 << 24
    LAND = 4 << 16 | 6 << 24
    DESCEND = 4 << 16 | 20 << 24
    """Down without a position; only a failsafe flies it."""

    @property
    def main(self) -> int:
        """PX4_CUSTOM_MAIN_MODE."""
        return self.value >> 16 & 0xFF

    @property
    def is_auto(self) -> bool:
        """Whether the navigator flies in this mode."""
        return self.main == 4
