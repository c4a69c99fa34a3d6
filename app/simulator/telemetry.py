"""Builds the messages that describe the vehicle."""

from __future__ import annotations

import math
from collections.abc import Callable

from app.simulator.airframe import Airframe
from app.simulator.clock import VehicleClock
from app.simulator.dialect import Message, mavlink
from app.simulator.faults import VehicleFaults
from app.simulator.geo import LocalFrame
from app.simulator.identity import Identity
from app.simulator.payload import Outputs
from app.simulator.state import VehicleState
from app.simulator.wire import Mode, SystemStatus

AUTOPILOT_PX4 = 12
BASE_AUTO = 29
"""CUSTOM_MODE, AUTO, GUIDED, STABILIZE: what PX4 shows in its auto modes."""
BASE_POSITION = 81
BASE_WITHOUT_STICKS = 17
"""Orbit and OFFBOARD: CUSTOM_MODE and STABILIZE, no manual input."""
BASE_ARMED = 128
SENSORS_PRESENT = 33603631
SENSORS_ENABLED = 33669167
SENSORS_HEALTHY = 52480063
SENSOR_GPS = 0x20
PREARM_CHECK = 0x10000000
"""Healthy when the vehicle can be armed [01_connect]."""
CELLS_FULL_MV, CELLS_EMPTY_MV = 16200, 14000
STANDARD_MODES = {Mode.POSCTL: 1, Mode.ORBIT: 2, Mode.ALTCTL: 4, Mode.RTL: 5, Mode.MISSION: 6, Mode.LAND: 7}
FULL_CIRCLE_CDEG = 36000


class Telemetry:
    """One method per message; `by_id` finds them for REQUEST_MESSAGE."""

    def __init__(
        self,
        state: VehicleState,
        airframe: Airframe,
        frame: LocalFrame,
        clock: VehicleClock,
        faults: VehicleFaults,
        identity: Identity,
        outputs: Outputs,
    ) -> None:
        self._state = state
        self._airframe = airframe
        self._frame = frame
        self._clock = clock
        self._faults = faults
        self._identity = identity
        self._outputs = outputs
        self.builders: dict[int, Callable[[], Message | None]] = {
            0: self.heartbeat,
            1: self.sys_status,
            24: self.gps_raw_int,
            30: self.attitude,
            32: self.local_position_ned,
            33: self.global_position_int,
            36: self.servo_output_raw,
            74: self.vfr_hud,
            141: self.altitude,
            147: self.battery_status,
            148: identity.autopilot_version,
            242: self.home_position,
            245: self.extended_sys_state,
            300: identity.protocol_version,
            360: self.orbit_execution_status,
        }
        if identity.profile.reports_current_mode:
            self.builders[436] = self.current_mode

    def by_id(self, message_id: int) -> Message | None:
        """The message now, or None when it does not exist or has nothing to say yet."""
        builder = self.builders.get(message_id)
        return builder() if builder is not None else None

    def heartbeat(self) -> Message:
        status, mode = self._state.status, self._shown_mode
        base = BASE_WITHOUT_STICKS if mode in (Mode.ORBIT, Mode.OFFBOARD) else BASE_POSITION
        if mode.is_auto:
            base = BASE_AUTO
        if status.armed:
            base |= BASE_ARMED
        return mavlink.MAVLink_heartbeat_message(
            self._airframe.mav_type, AUTOPILOT_PX4, base, mode, status.system_status, 3
        )

    def current_mode(self) -> Message:
        mode = self._shown_mode
        intended = self._state.status.intended
        return mavlink.MAVLink_current_mode_message(STANDARD_MODES.get(mode, 0), mode, intended)

    @property
    def _shown_mode(self) -> Mode:
        mode = self._state.status.shown_mode
        return mode if mode is not Mode.DESCEND or self._identity.profile.shows_descend else Mode.LAND

    def sys_status(self) -> Message:
        healthy = SENSORS_HEALTHY & ~SENSOR_GPS if self._faults.gps_lost else SENSORS_HEALTHY
        if self._state.status.system_status is not SystemStatus.UNINIT:
            healthy |= PREARM_CHECK
        return mavlink.MAVLink_sys_status_message(
            SENSORS_PRESENT, SENSORS_ENABLED, healthy, 98, self._voltage_mv(), -1, self._battery_percent(),
            0, 0, 0, 0, 0, 0,
        )  # fmt: skip

    def battery_status(self) -> Message:
        cells = [self._voltage_mv()] + [65535] * 9
        low = self._state.status.battery_fraction < 0.15
        return mavlink.MAVLink_battery_status_message(
            0, 1, 1, 32767, cells, -1, 0, -1, self._battery_percent(), 0, 2 if low else 1
        )

    def gps_raw_int(self) -> Message:
        body = self._state.body
        lat, lon = self._lat_lon()
        alt = self._altitude_mm()
        fix = 0 if self._faults.gps_lost else 3
        course = math.degrees(math.atan2(body.v_east_m_s, body.v_north_m_s)) % 360.0
        return mavlink.MAVLink_gps_raw_int_message(
            int(self._clock.now_s * 1e6), fix, lat, lon, alt, 70, 110, int(body.ground_speed_m_s * 100),
            int(course * 100) % FULL_CIRCLE_CDEG, 0 if self._faults.gps_lost else 10, alt, 900, 1780, 400,
        )  # fmt: skip

    def attitude(self) -> Message:
        body = self._state.body
        return mavlink.MAVLink_attitude_message(
            self._clock.boot_ms, body.roll_rad, body.pitch_rad, body.yaw_rad, 0.0, 0.0, 0.0
        )

    def local_position_ned(self) -> Message:
        body = self._state.body
        return mavlink.MAVLink_local_position_ned_message(
            self._clock.boot_ms, body.north_m, body.east_m, -body.up_m,
            body.v_north_m_s, body.v_east_m_s, -body.v_up_m_s,
        )  # fmt: skip

    def global_position_int(self) -> Message | None:
        """GLOBAL_POSITION_INT; not without a position."""
        if not self._state.status.position_valid:
            return None
        body = self._state.body
        lat, lon = self._lat_lon()
        home_m = self._state.status.home.up_m if self._state.status.home else 0.0
        return mavlink.MAVLink_global_position_int_message(
            self._clock.boot_ms, lat, lon, self._altitude_mm(), round((body.up_m - home_m) * 1000),
            round(body.v_north_m_s * 100), round(body.v_east_m_s * 100), round(-body.v_up_m_s * 100),
            round(math.degrees(body.yaw_rad) % 360.0 * 100) % FULL_CIRCLE_CDEG,
        )  # fmt: skip

    def servo_output_raw(self) -> Message:
        outputs = self._outputs.pulses_us()
        return mavlink.MAVLink_servo_output_raw_message(
            int(self._clock.now_s * 1e6) % 2**32, 0, *outputs[:8], *outputs[8:]
        )

    def vfr_hud(self) -> Message:
        body = self._state.body
        airspeed = math.hypot(
            body.v_north_m_s - self._faults.wind_north_m_s, body.v_east_m_s - self._faults.wind_east_m_s
        )
        heading = round(math.degrees(body.yaw_rad)) % 360
        return mavlink.MAVLink_vfr_hud_message(
            airspeed, body.ground_speed_m_s, heading, int(body.throttle * 100),
            self._frame.altitude_m + body.up_m, body.v_up_m_s,
        )  # fmt: skip

    def altitude(self) -> Message:
        body = self._state.body
        amsl = self._frame.altitude_m + body.up_m
        home_m = self._state.status.home.up_m if self._state.status.home else 0.0
        return mavlink.MAVLink_altitude_message(
            int(self._clock.now_s * 1e6), amsl, amsl, body.up_m, body.up_m - home_m, math.nan, body.up_m
        )

    def home_position(self) -> Message | None:
        """HOME_POSITION, once it is known."""
        home = self._state.status.home
        if home is None:
            return None
        lat, lon = self._frame.to_global(home.north_m, home.east_m)
        quaternion = [math.cos(home.yaw_rad / 2.0), 0.0, 0.0, math.sin(home.yaw_rad / 2.0)]
        return mavlink.MAVLink_home_position_message(
            round(lat * 1e7), round(lon * 1e7), round((self._frame.altitude_m + home.up_m) * 1000),
            home.north_m, home.east_m, -home.up_m, quaternion, 0.0, 0.0, 0.0, int(home.set_at_s * 1e6),
        )  # fmt: skip

    def extended_sys_state(self) -> Message:
        status = self._state.status
        return mavlink.MAVLink_extended_sys_state_message(status.vtol_state, status.landed_state)

    def orbit_execution_status(self) -> Message | None:
        """ORBIT_EXECUTION_STATUS: the height is above the sea from a multicopter, above the ground from a wing."""
        orbit = self._state.orbit
        if orbit is None:
            return None
        lat, lon = self._frame.to_global(*orbit.centre)
        height_m = orbit.up_m + (self._frame.altitude_m if self._state.status.mode is Mode.ORBIT else 0.0)
        return mavlink.MAVLink_orbit_execution_status_message(
            int(self._clock.now_s * 1e6), orbit.radius_m, 0, round(lat * 1e7), round(lon * 1e7), height_m
        )

    def _lat_lon(self) -> tuple[int, int]:
        lat, lon = self._frame.to_global(self._state.body.north_m, self._state.body.east_m)
        return round(lat * 1e7), round(lon * 1e7)

    def _altitude_mm(self) -> int:
        return round((self._frame.altitude_m + self._state.body.up_m) * 1000)

    def _battery_percent(self) -> int:
        return round(self._state.status.battery_fraction * 100)

    def _voltage_mv(self) -> int:
        return round(CELLS_EMPTY_MV + (CELLS_FULL_MV - CELLS_EMPTY_MV) * self._state.status.battery_fraction)
