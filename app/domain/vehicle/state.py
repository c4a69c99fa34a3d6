"""A vehicle: its type, its firmware, its facts (slow) and its state (fast)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from app.domain.model import FrozenForm
from app.domain.vehicle.clock import UNMEASURED, VehicleClock
from app.domain.vehicle.link_security import LinkSecurity
from app.domain.vehicle.performance import Performance


class InFlight(FrozenForm):
    """Place and motion at one moment; the altitude is above home.

    `wing_borne`: a VTOL that flies on its wing (EXTENDED_SYS_STATE.vtol_state). `asked_speed_m_s` is the speed that the
    plan asked for last: a new mission has to ask for it again. None: its own cruise speed.
    """

    latitude_deg: float
    longitude_deg: float
    relative_altitude_m: float
    ground_speed_m_s: float = 0.0
    course_deg: float | None = None
    wing_borne: bool = False
    asked_speed_m_s: float | None = None


FIRMWARE: Final = "firmware"
HOME: Final = "home"
"""Names of facts that are no parameters."""


class AutopilotKind(StrEnum):
    """What flies a vehicle: see app/domain/autopilot. From MAV_AUTOPILOT of the HEARTBEAT."""

    PX4 = "px4"


class VehicleType(StrEnum):
    """The vehicle types whose braking semantics differ. From MAV_TYPE of the HEARTBEAT."""

    MULTICOPTER = "multicopter"
    FIXED_WING = "fixed_wing"
    VTOL = "vtol"
    ROVER = "rover"
    AIRSHIP = "airship"

    @property
    def noun(self) -> str:
        """With its article, for sentences."""
        return _NOUNS.get(self, f"a {self.value.replace('_', ' ')}")


_NOUNS: Final = {VehicleType.VTOL: "a VTOL", VehicleType.AIRSHIP: "an airship"}


class LandedState(StrEnum):
    """EXTENDED_SYS_STATE.landed_state."""

    UNDEFINED = "undefined"
    ON_GROUND = "on_ground"
    IN_AIR = "in_air"
    TAKING_OFF = "taking_off"
    LANDING = "landing"


AIRBORNE: Final = frozenset({LandedState.IN_AIR, LandedState.TAKING_OFF, LandedState.LANDING})
"""A rover says so 0.6 s after arming (recording 25)."""


class VtolState(StrEnum):
    """MAV_VTOL_STATE; MAV_VTOL_STATE_UNDEFINED, as of all that is no VTOL, is None."""

    TRANSITION_TO_FIXED_WING = "transition_to_fixed_wing"
    TRANSITION_TO_MULTICOPTER = "transition_to_multicopter"
    MULTICOPTER = "multicopter"
    FIXED_WING = "fixed_wing"


IN_TRANSITION: Final = frozenset({VtolState.TRANSITION_TO_FIXED_WING, VtolState.TRANSITION_TO_MULTICOPTER})


class MissionState(StrEnum):
    """MISSION_CURRENT.mission_state. PX4 says `no_mission` for an infeasible mission too."""

    UNKNOWN = "unknown"
    NO_MISSION = "no_mission"
    NOT_STARTED = "not_started"
    ACTIVE = "active"
    PAUSED = "paused"
    COMPLETE = "complete"


class FlightMode(StrEnum):
    """The flight modes that Waydrop distinguishes, from PX4's custom_mode."""

    MISSION = "mission"
    HOLD = "hold"
    RETURN = "return"
    LAND = "land"
    TAKEOFF = "takeoff"
    OFFBOARD = "offboard"
    POSITION = "position"
    ALTITUDE = "altitude"
    MANUAL = "manual"
    STABILIZED = "stabilized"
    ORBIT = "orbit"
    DESCEND = "descend"
    OTHER = "other"


class GnssFix(StrEnum):
    """GPS_FIX_TYPE, from the weakest to the strongest."""

    NO_GPS = "no_gps"
    NO_FIX = "no_fix"
    FIX_2D = "2d"
    FIX_3D = "3d"
    DGPS = "dgps"
    RTK_FLOAT = "rtk_float"
    RTK_FIXED = "rtk_fixed"
    STATIC = "static"
    PPP = "ppp"


WITHOUT_FIX: Final = frozenset({GnssFix.NO_GPS, GnssFix.NO_FIX, GnssFix.FIX_2D})
"""With these the position is what the autopilot estimates: PX4 goes on with it for seconds."""


@dataclass(frozen=True, slots=True, order=True)
class FirmwareVersion:
    """AUTOPILOT_VERSION.flight_sw_version, as three numbers."""

    major: int
    minor: int
    patch: int

    def __str__(self) -> str:
        return f"{self.major}.{self.minor}.{self.patch}"


@dataclass(frozen=True, slots=True)
class GlobalPosition:
    """A place on earth. `altitude_m` is AMSL."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float


def _nobody_listens(_name: str) -> None:
    pass


@dataclass(frozen=True, slots=True)
class VehicleProfile:
    """What a plan is checked against. Unknown things are None; rules must then take the strict side.

    `parameters` holds the autopilot's parameters by name as read from the vehicle: what they mean says `autopilot`.
    Those that it does not have are in neither; `unanswered` were asked for, and nobody knows whether it has them.
    `least_clock_rate`: see VehicleClock.least_rate. `in_flight`: it flies now, and the mission begins there; None: it
    begins on the ground, at home. `performance` is what the operator declares of it, `battery_percent` its charge as
    the facts were read. `assuming` is called with the name of each fact that is asked for, is not known and is assumed.
    `parameters_age_s`: how long ago all of them were known to be the vehicle's; None: not since the link was lost.
    Facts that differ in this alone are the same. `asked` keeps what domain/autopilot made of them: a plan asks the
    same thousands of times.
    """

    vehicle_type: VehicleType
    firmware: FirmwareVersion | None = None
    uid: str | None = None
    home: GlobalPosition | None = None
    parameters: Mapping[str, float | int] = field(default_factory=dict)
    unanswered: frozenset[str] = frozenset()
    max_mission_items: int | None = None
    max_fence_items: int | None = None
    max_rally_points: int | None = None
    least_clock_rate: float | None = None
    in_flight: InFlight | None = None
    performance: Performance | None = None
    battery_percent: float | None = None
    assuming: Callable[[str], None] = field(default=_nobody_listens, compare=False, repr=False)
    parameters_age_s: float | None = field(default=None, compare=False)
    autopilot: AutopilotKind = AutopilotKind.PX4
    asked: dict[str, tuple[float, tuple[str, ...]]] = field(default_factory=dict, init=False, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture that a camera reported (CAMERA_IMAGE_CAPTURED). `url` may be empty.

    `index` counts the pictures of the camera. The position is the one that the camera reports, the altitude above mean
    sea level.
    """

    index: int
    captured: bool
    latitude_deg: float
    longitude_deg: float
    absolute_altitude_m: float
    url: str = ""


@dataclass(frozen=True, slots=True)
class SignalDurations:
    """For how long messages of one kind have reported the same, from the first to the newest, in seconds.

    A different message restarts it, and so does a gap of 5 s. `disarmed_s`: HEARTBEAT; `on_ground_s`:
    EXTENDED_SYS_STATE; `at_rest_s`: GLOBAL_POSITION_INT; `mission_current_s`: MISSION_CURRENT, unchanged.
    """

    disarmed_s: float = 0.0
    on_ground_s: float = 0.0
    at_rest_s: float = 0.0
    mission_current_s: float = 0.0


@dataclass(frozen=True, slots=True)
class VehicleState:
    """The newest measurements. Each `*_age_s` says how old its group is; None means never received.

    Sources: HEARTBEAT (mode, armed), EXTENDED_SYS_STATE, GLOBAL_POSITION_INT, BATTERY_STATUS, MISSION_CURRENT,
    GPS_RAW_INT (gnss, None again when it has not come for 5 s).
    `boot_time_s` is the vehicle's own clock (GLOBAL_POSITION_INT.time_boot_ms) at the newest position: it runs faster
    than ours in a simulation with a speed factor, and a bounded hold is counted on it. `clock` is how fast.
    `home_ned_m` is home from the EKF origin, from where local setpoints count: north, east, down (HOME_POSITION.x ...).
    `has_gripper_output`: a servo output is assigned to the gripper; None: not known.
    `gripper_output_us` is SERVO_OUTPUT_RAW of the gripper's output (2000 grab, 1000 release, 900 disarmed); None while
    its channel is not known. It is what the autopilot commands, not what a sensor saw. A new value counts once it was
    said for a quarter of a second without another one between; `gripper_output_newest_us` is the newest one.
    `durations`: None where nobody measures them, as in a recording; what is said counts then as it is.
    `in_failsafe`: a failsafe has chosen the mode, or may have. `is_critical`: HEARTBEAT says MAV_STATE_CRITICAL, which
    PX4 does for a mere warning, too, such as of a low battery.
    `is_terminated`: the autopilot has stopped the motors, by a failsafe or the kill switch, whatever the mode says.
    `failsafe_delay_s`: for how long a failsafe has held the vehicle in Hold mode, which is not the intended one; None:
    it does not. PX4 holds before most failsafes act.
    """

    connected: bool = False
    link_security: LinkSecurity | None = None
    mode: FlightMode | None = None
    armed: bool | None = None
    landed: LandedState = LandedState.UNDEFINED
    in_failsafe: bool = False
    is_critical: bool = False
    is_terminated: bool = False
    latitude_deg: float | None = None
    longitude_deg: float | None = None
    absolute_altitude_m: float | None = None
    relative_altitude_m: float | None = None
    velocity_north_m_s: float | None = None
    velocity_east_m_s: float | None = None
    velocity_down_m_s: float | None = None
    heading_deg: float | None = None
    position_age_s: float | None = None
    heartbeat_age_s: float | None = None
    battery_percent: float | None = None
    home: GlobalPosition | None = None
    home_ned_m: tuple[float, float, float] | None = None
    mission_seq: int | None = None
    mission_total: int | None = None
    mission_state: MissionState = MissionState.UNKNOWN
    mission_id: int | None = None
    mission_age_s: float | None = None
    fence_id: int | None = None
    rally_points_id: int | None = None
    vtol_state: VtolState | None = None
    boot_time_s: float | None = None
    gnss_fix: GnssFix | None = None
    gnss_satellites: int | None = None
    gnss_hdop: float | None = None
    clock: VehicleClock = UNMEASURED
    has_gripper_output: bool | None = None
    gripper_output_us: int | None = None
    gripper_output_age_s: float | None = None
    gripper_output_newest_us: int | None = None
    picture: Picture | None = None
    durations: SignalDurations | None = None
    failsafe_delay_s: float | None = None

    @property
    def may_be_in_failsafe(self) -> bool:
        """Of a vehicle in the mode that was asked for nothing tells a warning from a failsafe that is about to act."""
        return self.in_failsafe or self.is_critical

    @property
    def ground_speed_m_s(self) -> float | None:
        """Horizontal speed over ground, or None before the first position."""
        if self.velocity_north_m_s is None or self.velocity_east_m_s is None:
            return None
        return float((self.velocity_north_m_s**2 + self.velocity_east_m_s**2) ** 0.5)


MISSION_SURE_S: Final = 0.8
"""MISSION_CURRENT has a rate of 1 Hz: two of them agree."""


def mission_is_sure(state: VehicleState) -> bool:
    """Whether more than one MISSION_CURRENT confirms the mission in the state."""
    return state.durations is None or state.durations.mission_current_s >= MISSION_SURE_S


def names_other_mission(state: VehicleState, mission_id: int | None) -> bool:
    """Whether the vehicle names another mission than this one. Some firmware names none."""
    return None not in (state.mission_id, mission_id) and state.mission_id != mission_id


class FlightRegime(StrEnum):
    """What carries the vehicle: this decides whether it can stop."""

    GROUND = "ground"
    ROTARY_WING = "rotary_wing"
    FIXED_WING = "fixed_wing"
    WHEELS = "wheels"
    BUOYANCY = "buoyancy"


IN_AIR: Final[Mapping[VehicleType, FlightRegime]] = {
    VehicleType.MULTICOPTER: FlightRegime.ROTARY_WING,
    VehicleType.FIXED_WING: FlightRegime.FIXED_WING,
    VehicleType.VTOL: FlightRegime.ROTARY_WING,
    VehicleType.ROVER: FlightRegime.WHEELS,
    VehicleType.AIRSHIP: FlightRegime.BUOYANCY,
}
"""After an automatic takeoff; a rover drives."""


def carried_in_flight(vehicle_type: VehicleType, in_flight: InFlight | None = None) -> FlightRegime:
    """What carries a vehicle that flies, or drives, now; by itself a VTOL hovers."""
    if vehicle_type is VehicleType.VTOL and in_flight is not None and in_flight.wing_borne:
        return FlightRegime.FIXED_WING
    return IN_AIR[vehicle_type]


_TYPES: Final = {
    1: VehicleType.FIXED_WING,
    2: VehicleType.MULTICOPTER,  # quadrotor
    3: VehicleType.MULTICOPTER,  # coaxial helicopter
    4: VehicleType.MULTICOPTER,  # helicopter
    7: VehicleType.AIRSHIP,
    10: VehicleType.ROVER,
    13: VehicleType.MULTICOPTER,  # hexarotor
    14: VehicleType.MULTICOPTER,  # octorotor
    15: VehicleType.MULTICOPTER,  # tricopter
    **dict.fromkeys(range(19, 26), VehicleType.VTOL),
    29: VehicleType.MULTICOPTER,  # dodecarotor
    35: VehicleType.MULTICOPTER,  # decarotor
}

_USUAL: Final = {
    VehicleType.FIXED_WING: 1,
    VehicleType.MULTICOPTER: 2,
    VehicleType.AIRSHIP: 7,
    VehicleType.ROVER: 10,
    VehicleType.VTOL: 22,  # fixed rotors: what PX4 calls a standard VTOL
}


def vehicle_type(mav_type: int) -> VehicleType | None:
    """The vehicle type; None for a MAV_TYPE that Waydrop cannot fly."""
    return _TYPES.get(mav_type)


def usual_mav_type(kind: VehicleType) -> int:
    """The MAV_TYPE of a vehicle type in files."""
    return _USUAL[kind]
