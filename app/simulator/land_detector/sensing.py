"""What the land detectors read: the sensors' readings, derived from the kinematic body."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, auto

from app.simulator.airframe import Airframe
from app.simulator.clock import VehicleClock
from app.simulator.faults import VehicleFaults
from app.simulator.geo import wrap_pi
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint
from app.simulator.state import VehicleState
from app.simulator.wire import Mode, VtolState

WITHOUT_CLIMB_CONTROL = frozenset({Mode.MANUAL, Mode.ACRO, Mode.STABILIZED, Mode.TERMINATION})


class TakeoffState(Enum):
    """takeoff_status_s.takeoff_state, of multicopters."""

    GROUND = auto()
    RAMPUP = auto()
    """The thrust rises, the vehicle still stands."""
    FLIGHT = auto()


@dataclass(slots=True)
class LandSample:
    """Metres, m/s, m/s2, rad/s; throttle 0..1. Speeds are sizes, without a sign."""

    armed: bool
    mode: Mode
    fixed_wing: bool
    """vehicle_status.vehicle_type: a VTOL is fixed wing only when its transition is complete."""
    v_xy_m_s: float
    v_xy_valid: bool
    v_z_m_s: float
    climb_command_m_s: float
    """What the position controller is commanded, up is positive."""
    throttle: float
    hover_throttle: float | None
    """The hover thrust estimate; None while there is none (it needs flight)."""
    airspeed_m_s: float | None
    """None without a sensor."""
    specific_force_m_s2: float
    """Size of what the accelerometer feels: 9.81 at rest, 0 in free fall."""
    acceleration_xy_m_s2: float
    """Accelerometer, in the body's x and y."""
    rate_xy_rad_s: float
    rate_rad_s: float
    dist_bottom_m: float | None
    """Range to the ground; None while it is not valid."""
    has_range_sensor: bool
    takeoff_state: TakeoffState
    last_point_distance_m: float = math.inf
    """Over ground, to the setpoint that no other follows; infinite while another one does."""

    @property
    def climb_rate_controlled(self) -> bool:
        """flag_control_climb_rate_enabled: in all modes but the plainly manual ones and a terminated flight."""
        return self.mode not in WITHOUT_CLIMB_CONTROL


GRAVITY_M_S2 = 9.81
RANGE_MAX_M = 100.0
"""SIH_DISTSNSR_MAX."""

Attitude = tuple[float, float, float]
Velocity = tuple[float, float, float]


class Sensing:
    """Modelled: accelerations and rates as differences between cycles, no noise, no vibration of the frame."""

    def __init__(self, state: VehicleState, airframe: Airframe, params: Params, faults: VehicleFaults) -> None:
        self._state = state
        self._airframe = airframe
        self._has_range_sensor = airframe.has_range_sensor
        self._params = params
        self._faults = faults
        self._velocity: Velocity = (0.0, 0.0, 0.0)
        self._attitude: Attitude = (0.0, 0.0, 0.0)
        self._last_point: tuple[float, float] | None = None

    def restart(self) -> None:
        """Power-up: the body was put back, which is no movement."""
        self._remember()

    def sample(self, setpoint: Setpoint) -> LandSample:
        """One cycle's readings."""
        status, body = self._state.status, self._state.body
        forward, right, up = self._acceleration()
        roll_rate, pitch_rate, yaw_rate = self._rates()
        self._remember()
        return LandSample(
            armed=status.armed,
            mode=status.mode,
            fixed_wing=self._airframe.is_fixed_wing or status.vtol_state == VtolState.FW,
            v_xy_m_s=body.ground_speed_m_s,
            v_xy_valid=not self._faults.gps_lost,
            v_z_m_s=abs(body.v_up_m_s),
            climb_command_m_s=body.climb_command_m_s,
            throttle=body.throttle,
            hover_throttle=self._hover_throttle(),
            airspeed_m_s=self._airspeed(),
            specific_force_m_s2=math.hypot(forward, right, up + GRAVITY_M_S2),
            acceleration_xy_m_s2=math.hypot(forward, right - GRAVITY_M_S2 * math.tan(body.roll_rad)),
            rate_xy_rad_s=math.hypot(roll_rate, pitch_rate),
            rate_rad_s=math.hypot(roll_rate, pitch_rate, yaw_rate),
            dist_bottom_m=self._range(),
            has_range_sensor=self._has_range_sensor,
            takeoff_state=self._takeoff_state(),
            last_point_distance_m=self._last_point_distance(setpoint),
        )

    def _remember(self) -> None:
        body = self._state.body
        self._velocity = (body.v_north_m_s, body.v_east_m_s, body.v_up_m_s)
        self._attitude = (body.roll_rad, body.pitch_rad, body.yaw_rad)

    def _acceleration(self) -> tuple[float, float, float]:
        """Forward, right, up, of the motion alone."""
        body, before = self._state.body, self._velocity
        north = (body.v_north_m_s - before[0]) / VehicleClock.STEP_S
        east = (body.v_east_m_s - before[1]) / VehicleClock.STEP_S
        up = (body.v_up_m_s - before[2]) / VehicleClock.STEP_S
        cos, sin = math.cos(body.yaw_rad), math.sin(body.yaw_rad)
        return north * cos + east * sin, east * cos - north * sin, up

    def _rates(self) -> tuple[float, float, float]:
        body, before = self._state.body, self._attitude
        if before == (body.roll_rad, body.pitch_rad, body.yaw_rad):
            return 0.0, 0.0, 0.0
        roll = wrap_pi(body.roll_rad - before[0]) / VehicleClock.STEP_S
        pitch = wrap_pi(body.pitch_rad - before[1]) / VehicleClock.STEP_S
        return roll, pitch, wrap_pi(body.yaw_rad - before[2]) / VehicleClock.STEP_S

    def _airspeed(self) -> float | None:
        if not self._airframe.has_airspeed_sensor or self._params.integer("SYS_HAS_NUM_ASPD") == 0:
            return None
        body, faults = self._state.body, self._faults
        return math.hypot(body.v_north_m_s - faults.wind_north_m_s, body.v_east_m_s - faults.wind_east_m_s)

    def _range(self) -> float | None:
        up_m = self._state.body.up_m
        seen = self._has_range_sensor and not self._faults.range_lost and up_m <= RANGE_MAX_M
        return up_m if seen else None

    def _last_point_distance(self, setpoint: Setpoint) -> float:
        """To the setpoint of the cycle before: PX4's navigator answers a new mode after the land detector saw it."""
        body, point = self._state.body, self._last_point
        self._last_point = setpoint.point if setpoint.next is None else None
        return math.inf if point is None else math.dist((body.north_m, body.east_m), point)

    def _hover_throttle(self) -> float | None:
        """The estimator knows the true value as soon as it flies; it stops with the landing."""
        runs = self._params.integer("MPC_USE_HTE") == 1 and self._state.status.armed
        return self._airframe.hover_throttle if runs and not self._state.status.land.landed else None

    def _takeoff_state(self) -> TakeoffState:
        body = self._state.body
        if not body.on_ground:
            return TakeoffState.FLIGHT
        ramping = self._state.status.armed and body.climb_command_m_s > 0.0 and body.throttle > 0.0
        return TakeoffState.RAMPUP if ramping else TakeoffState.GROUND
