"""The newest measurements of a vehicle, each with its arrival time, and what changed by a message."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

from app.domain.vehicle.clock import VehicleClock
from app.domain.vehicle.facts import LinkFact, MissionCurrent, StateChanged
from app.domain.vehicle.link_security import LinkSecurity
from app.domain.vehicle.state import (
    AutopilotKind,
    FlightMode,
    GlobalPosition,
    GnssFix,
    LandedState,
    MissionState,
    VehicleState,
    VtolState,
)
from app.vehicles.decoders import (
    BatteryStatus,
    CurrentMode,
    ExtendedSysState,
    GlobalPositionInt,
    GpsRawInt,
    Heartbeat,
    HomePosition,
    MissionCurrentReport,
    Report,
    SysStatus,
)
from app.vehicles.modes import autopilot_of, flight_mode
from app.vehicles.steadiness import Steadiness, SteadyOutput

_FIX: Final = tuple(GnssFix)
_LANDED: Final = tuple(LandedState)
_MISSION: Final = tuple(MissionState)
_VTOL: Final = (None, *VtolState)
_ARMED: Final = 128
_NOT_GONE_BACK_TO: Final = frozenset({FlightMode.RETURN, FlightMode.LAND, FlightMode.TAKEOFF, FlightMode.OTHER})
"""Modes in which PX4 cannot be armed, or may not: it does not keep them when it disarms."""
_CRITICAL: Final = 5
_TERMINATED: Final = 8
"""MAV_STATE_FLIGHT_TERMINATION, by a failsafe or the kill switch. PX4 v1.19 shows no mode of its own for it."""
_NO_MISSION_TOTAL: Final = 65535
_HEADING_UNKNOWN: Final = 65535
_HDOP_UNKNOWN: Final = 65535
_SATELLITES_UNKNOWN: Final = 255
CLOCK_WINDOW_S: Final = 10.0
"""Long enough to distinguish 5x from 4x although a message may be late."""

GNSS_FRESH_S: Final = 5.0
"""GPS_RAW_INT is asked for at 1 Hz: one that is older says nothing of a position that is newer."""


@dataclass(slots=True)
class Measurements:
    """Times are monotonic arrival times; None means never received."""

    heartbeat: Heartbeat | None = None
    heartbeat_s: float | None = None
    mode: FlightMode | None = None
    intended_mode: FlightMode | None = None
    before_descent: FlightMode | None = None
    """The mode that was asked for last, apart from those that bring it down: PX4 goes back to it when it disarms."""
    tells_intended_mode: bool = False
    is_unattributed: bool = False
    """HEARTBEAT shows a new mode during a warning: whose it is, CURRENT_MODE tells soon."""
    in_failsafe: bool = False
    is_critical: bool = False
    is_terminated: bool = False
    system: ExtendedSysState | None = None
    position: GlobalPositionInt | None = None
    position_s: float | None = None
    gnss: GpsRawInt | None = None
    gnss_s: float | None = None
    clock: VehicleClock = field(default_factory=lambda: VehicleClock(window_s=CLOCK_WINDOW_S))
    home: GlobalPosition | None = None
    home_ned_m: tuple[float, float, float] | None = None
    battery_percent: float | None = None
    battery_from_battery: bool = False
    mission: MissionCurrentReport | None = None
    mission_s: float | None = None
    has_gripper_output: bool | None = None
    gripper: SteadyOutput = field(default_factory=SteadyOutput)
    steadiness: Steadiness = field(default_factory=Steadiness)
    reported: dict[str, Any] = field(default_factory=dict)
    """What is a field of the state just as it came."""

    def take_heartbeat(self, message: Heartbeat, received_s: float) -> LinkFact | None:
        """HEARTBEAT: mode, armed, failsafe."""
        self.steadiness.heartbeat(message, received_s)
        old, before = self.heartbeat, (self.mode, self.in_failsafe, self.is_critical, self.is_terminated)
        was_warned = self.is_critical and not self.in_failsafe
        self.heartbeat, self.heartbeat_s = message, received_s
        mode_before, self.mode = self.mode, flight_mode(message.custom_mode, self.heartbeat)
        self.is_terminated = message.system_status == _TERMINATED
        self.is_critical = message.system_status == _CRITICAL
        self.is_unattributed = was_warned and self.tells_intended_mode and self.mode is not mode_before
        chosen = self.mode is not self.intended_mode  # else no failsafe acts: it warns, as of a low battery
        self.in_failsafe = self.is_terminated or (self.is_critical and chosen and not self.is_unattributed)
        if not (self.in_failsafe or self.is_unattributed):
            self._intend(self.mode)
        self._time_failsafe(received_s)
        same = (
            old is not None
            and (old.base_mode ^ message.base_mode) & _ARMED == 0
            and before == (self.mode, self.in_failsafe, self.is_critical, self.is_terminated)
        )
        return None if same else StateChanged()

    def take_mode(self, message: CurrentMode, received_s: float) -> LinkFact | None:
        """CURRENT_MODE: the mode, sooner than the next HEARTBEAT.

        A mode that is not the intended one was chosen by a failsafe (PX4: nav_state beside nav_state_user_intention).
        Were the failsafe of the last HEARTBEAT kept, the new mode would be reported with the cause of the one before.
        """
        before, was_in_failsafe = self.mode, self.in_failsafe
        self.mode = flight_mode(message.custom_mode, self.heartbeat)
        if message.intended_custom_mode:  # 0 is "not known"
            self.tells_intended_mode = True
            self._intend(flight_mode(message.intended_custom_mode, self.heartbeat))
            chosen = message.custom_mode != message.intended_custom_mode
            if self.mode is not before or not chosen or self.is_unattributed:
                self.is_unattributed = False
                is_by_failsafe = chosen and self.mode is not FlightMode.OTHER  # which a mode executor shows as its own
                self.in_failsafe = self.is_terminated or is_by_failsafe
        self._time_failsafe(received_s)
        return None if (before, was_in_failsafe) == (self.mode, self.in_failsafe) else StateChanged()

    def _time_failsafe(self, received_s: float) -> None:
        """A pause while a mere warning is active is no hold of a failsafe: there Hold is the intended mode."""
        holds = self.in_failsafe and self.mode is FlightMode.HOLD and self.intended_mode is not FlightMode.HOLD
        self.steadiness.failsafe_delay.observe(holds, received_s)

    def _intend(self, mode: FlightMode) -> None:
        self.intended_mode = mode
        if mode not in _NOT_GONE_BACK_TO:
            self.before_descent = mode

    @property
    def autopilot(self) -> AutopilotKind:
        """By the HEARTBEAT."""
        return autopilot_of(self.heartbeat)

    @property
    def goes_back_to_offboard(self) -> bool:
        """Whether OFFBOARD is, or may be, what was asked for before the way down: a failsafe may fly another mode, and
        somebody else may have commanded Return.
        """
        if FlightMode.OFFBOARD in (self.mode, self.intended_mode, self.before_descent):
            return True
        return self.in_failsafe and self.intended_mode is None

    def take_system(self, message: ExtendedSysState, received_s: float) -> LinkFact | None:
        """EXTENDED_SYS_STATE: landed_state, vtol_state."""
        self.steadiness.system(message, received_s)
        old, self.system = self.system, message
        return None if old == message else StateChanged()

    def take_position(self, message: GlobalPositionInt, received_s: float) -> None:
        """GLOBAL_POSITION_INT. One that newer ones have overtaken is left out: time would run backwards."""
        back_s = 0.0 if self.position is None else (self.position.time_boot_ms - message.time_boot_ms) / 1e3
        if self.clock.is_overtaken(back_s):
            return
        self.steadiness.position(message, received_s)
        self.position, self.position_s = message, received_s
        self.clock = self.clock.seen(received_s, message.time_boot_ms / 1e3)

    def take_gnss(self, message: GpsRawInt, received_s: float) -> None:
        """GPS_RAW_INT: how good the position is."""
        self.gnss, self.gnss_s = message, received_s

    def take_report(self, report: Report) -> None:
        """A message that needs no more than to be kept."""
        self.reported[report.field] = report.value

    def take_home(self, message: HomePosition) -> None:
        """HOME_POSITION: it moves to where the vehicle disarms."""
        self.home = GlobalPosition(message.latitude / 1e7, message.longitude / 1e7, message.altitude / 1e3)
        self.home_ned_m = (message.x, message.y, message.z)

    def take_battery(self, message: BatteryStatus | SysStatus) -> None:
        """The first battery's charge; SYS_STATUS only while there is no BATTERY_STATUS."""
        if isinstance(message, BatteryStatus):
            if message.id != 0:
                return
            self.battery_from_battery = True
        elif self.battery_from_battery:
            return
        self.battery_percent = float(message.battery_remaining) if message.battery_remaining >= 0 else None

    def take_mission(self, message: MissionCurrentReport, received_s: float) -> LinkFact | None:
        self.steadiness.mission(message, received_s)
        old, self.mission = self.mission, message
        self.mission_s = received_s
        return None if old == message else MissionCurrent(message.seq, self.mode, message.mission_id or None)

    def take_clock_rate(self, rate: float) -> None:
        """A simulator was set to another speed."""
        self.clock = self.clock.set_to(rate)

    def take_gripper_assignment(self, is_assigned: bool | None, *, is_same: bool) -> None:
        """Whether an output is assigned to the gripper. What another output said counts no more."""
        self.has_gripper_output = is_assigned
        if not is_same:
            self.gripper = SteadyOutput()

    def take_gripper_output(self, output_us: int, received_s: float) -> bool:
        """SERVO_OUTPUT_RAW of the gripper's output. Whether it is another than before."""
        return self.gripper.observe(output_us, received_s)

    def forget_after_reboot(self) -> None:
        """What the vehicle said before it restarted is not true any more."""
        self.mission = self.mission_s = None
        self.gripper, self.steadiness = SteadyOutput(), Steadiness()
        self.has_gripper_output = None
        self.clock = VehicleClock(window_s=CLOCK_WINDOW_S)

    def state(self, now_s: float, *, connected: bool, security: LinkSecurity | None = None) -> VehicleState:
        """All of it, with ages at `now_s`."""
        beat, place, mission, system = self.heartbeat, self.position, self.mission, self.system
        gnss = self.gnss if self.gnss_s is not None and now_s - self.gnss_s <= GNSS_FRESH_S else None
        total = None if mission is None or mission.total == _NO_MISSION_TOTAL else mission.total
        return VehicleState(
            connected=connected,
            link_security=security,
            mode=self.mode,
            armed=None if beat is None else bool(beat.base_mode & _ARMED),
            landed=LandedState.UNDEFINED if system is None else _word(_LANDED, system.landed_state),
            in_failsafe=self.in_failsafe,
            is_critical=self.is_critical,
            is_terminated=self.is_terminated,
            latitude_deg=None if place is None else place.lat / 1e7,
            longitude_deg=None if place is None else place.lon / 1e7,
            absolute_altitude_m=None if place is None else place.alt / 1e3,
            relative_altitude_m=None if place is None else place.relative_alt / 1e3,
            velocity_north_m_s=None if place is None else place.vx / 1e2,
            velocity_east_m_s=None if place is None else place.vy / 1e2,
            velocity_down_m_s=None if place is None else place.vz / 1e2,
            heading_deg=None if place is None or place.hdg == _HEADING_UNKNOWN else place.hdg / 1e2,
            position_age_s=_age(self.position_s, now_s),
            heartbeat_age_s=_age(self.heartbeat_s, now_s),
            battery_percent=self.battery_percent,
            home=self.home,
            home_ned_m=self.home_ned_m,
            mission_seq=None if mission is None else mission.seq,
            mission_total=total,
            mission_state=MissionState.UNKNOWN if mission is None else mission_state(mission),
            mission_id=None if mission is None or not mission.mission_id else mission.mission_id,
            mission_age_s=_age(self.mission_s, now_s),
            fence_id=None if mission is None or not mission.fence_id else mission.fence_id,
            rally_points_id=None if mission is None or not mission.rally_points_id else mission.rally_points_id,
            vtol_state=None if system is None or system.vtol_state >= len(_VTOL) else _VTOL[system.vtol_state],
            clock=self.clock,
            boot_time_s=None if place is None else place.time_boot_ms / 1e3,
            gnss_fix=None if gnss is None or gnss.fix_type >= len(_FIX) else _FIX[gnss.fix_type],
            gnss_satellites=None if gnss is None else _known(gnss.satellites_visible, _SATELLITES_UNKNOWN),
            gnss_hdop=None if gnss is None or gnss.eph == _HDOP_UNKNOWN else gnss.eph / 1e2,
            has_gripper_output=self.has_gripper_output,
            gripper_output_us=self.gripper.us,
            gripper_output_age_s=_age(self.gripper.heard_s, now_s),
            gripper_output_newest_us=self.gripper.newest_us,
            durations=self.steadiness.durations(),
            failsafe_delay_s=self.steadiness.failsafe_delay_s,
            **self.reported,
        )


def mission_state(message: MissionCurrentReport) -> MissionState:
    """The word for MISSION_CURRENT.mission_state; unknown for numbers that MAVLink does not know."""
    return _MISSION[message.mission_state] if message.mission_state < len(_MISSION) else MissionState.UNKNOWN


def _word(words: tuple[LandedState, ...], number: int) -> LandedState:
    return words[number] if number < len(words) else LandedState.UNDEFINED


def _known(value: int, unknown: int) -> int | None:
    return None if value == unknown else value


def _age(at_s: float | None, now_s: float) -> float | None:
    return None if at_s is None else max(0.0, now_s - at_s)
