"""A multicopter: a smoothed trajectory point runs ahead, and a velocity loop with drag follows it.

The shape (a quick rise to about 80 % of the cruise speed, then a slow creep up; an overshoot of 0.8 m when stopping;
a turn that swings out by some metres and a slow leg after it) comes from PX4's own structure, not from curve fitting.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import Enum, auto

from app.simulator.dynamics.hovering_wing import WingedControl
from app.simulator.dynamics.model import Wind
from app.simulator.dynamics.position_control import Axis, PositionControl
from app.simulator.dynamics.position_smoothing import Leg, Point, PositionSmoothing, VelocitySmoothing
from app.simulator.geo import wrap_pi
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint, SetpointKind
from app.simulator.state import Body, Status

# The thrust of a multicopter that stands on the ground: the ramp before a takeoff, the fall after a touch-down.


GRAVITY_M_S2 = 9.81
HEIGHT_GAIN = 1.0  # MPC_Z_P
CLIMB_GAIN = 4.0  # MPC_Z_VEL_P_ACC
CLIMB_INTEGRAL_GAIN = 2.0  # MPC_Z_VEL_I_ACC
WANTED_AFTER_S = 0.4
"""A way that begins at rest asks for 0.3 m/s upwards after this (FlightTask::_checkTakeoff, MPC_JERK_AUTO)."""


class GroundThrust:
    """Modelled: PX4's height and climb rate loops winding up against the ground [25_land_detector_quad, within 0.02].

    The land detector's verdicts feed back: ground contact leaves minimum thrust, maybe landed none.
    """

    def __init__(self, params: Params, status: Status, hover_throttle: float) -> None:
        self._params = params
        self._status = status
        self._hover_throttle = hover_throttle
        self._armed_s = 0.0
        self._pushing_s = 0.0

    def restart(self) -> None:
        """Disarmed, or taken off."""
        self._armed_s = self._pushing_s = 0.0

    def touch_down(self) -> None:
        """The ground stops the descent; the motors have been running for long."""
        self._armed_s = float(self._params["COM_SPOOLUP_TIME"])
        self._pushing_s = 0.0

    @property
    def climb_ramp_m_s2(self) -> float:
        """How fast the climb that the controller allows rises (TakeoffHandling::updateRamp), from all the way down."""
        most_m_s = 1.2 * float(self._params["MPC_Z_V_AUTO_UP"])
        return (GRAVITY_M_S2 / CLIMB_GAIN + most_m_s) / max(float(self._params["MPC_TKO_RAMP_T"]), 1e-3)

    @property
    def lifts_after_s(self) -> float:
        """From a target in the air, that is no takeoff, to hover thrust: the ramp has to undo its own integrator."""
        ramp, down_m_s = self.climb_ramp_m_s2, GRAVITY_M_S2 / CLIMB_GAIN
        square, linear = CLIMB_INTEGRAL_GAIN * ramp / 2.0, CLIMB_GAIN * ramp - CLIMB_INTEGRAL_GAIN * down_m_s
        root = math.sqrt(linear**2 + 4.0 * square * CLIMB_GAIN * down_m_s)
        return WANTED_AFTER_S + (root - linear) / (2.0 * square)

    def step(self, throttle: float, climb_command_m_s: float, dt_s: float, *, takes_off: bool = True) -> float:
        """The next throttle, 0..1. `takes_off`: a takeoff is what is asked for, and no other place in the air."""
        self._armed_s += dt_s
        if climb_command_m_s > 0.0:
            self._pushing_s = 0.0
            ramp_s = float(self._params["MPC_TKO_RAMP_T"]) if takes_off else self.lifts_after_s
            return self._ramp(throttle, max(ramp_s, dt_s), dt_s)
        if self._status.land.maybe_landed:
            self._pushing_s = 0.0
            return 0.0
        self._pushing_s += dt_s
        lowest = float(self._params["MPC_THR_MIN"])
        if self._status.land.ground_contact:
            return lowest
        return min(throttle, max(lowest, self._wound_up(-climb_command_m_s)))

    def _ramp(self, throttle: float, ramp_s: float, dt_s: float) -> float:
        """Up to the hover thrust that the parameters say, once the motors have spooled up."""
        if self._armed_s < float(self._params["COM_SPOOLUP_TIME"]):
            return 0.0
        slope_per_s = float(self._params["MPC_THR_HOVER"]) / ramp_s
        return min(1.0, throttle + slope_per_s * dt_s)

    def _wound_up(self, descent_m_s: float) -> float:
        """The commanded point sinks on below the ground: its distance and the integrator both grow."""
        time_s = self._pushing_s
        missing_m_s = descent_m_s * (1.0 + HEIGHT_GAIN * time_s)
        integral_m = descent_m_s * (time_s + HEIGHT_GAIN * time_s**2 / 2.0)
        acceleration = CLIMB_GAIN * missing_m_s + CLIMB_INTEGRAL_GAIN * integral_m
        return self._hover_throttle * (1.0 - acceleration / GRAVITY_M_S2)


# What a multicopter's flight task makes of the navigator's three points (FlightTaskAuto's internal waypoints).


SAME_M = 0.001
STOPS = (SetpointKind.LOITER, SetpointKind.LAND)
"""Nothing comes after these, also when a mission goes on from its landing."""

_Ends = tuple[Point, bool, bool]


class _Place(Enum):
    ON_TRACK = auto()
    TARGET_BEHIND = auto()
    START_AHEAD = auto()
    OFF_TRACK = auto()


class FlightTrack:
    """The line to fly; beside it by more than the acceptance radius the vehicle goes back to it first."""

    def __init__(self) -> None:
        self._known: _Ends | None = None
        self._place = _Place.ON_TRACK
        self._given = self._leg = Leg((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)

    def reset(self) -> None:
        """Forget: the next setpoint is a new one."""
        self._known = None

    def leg(self, body: Point, setpoint: Setpoint) -> Leg:
        renewed = self._take(setpoint)
        before, (self._place, closest) = self._place, self._where(body)
        if renewed or self._place is not before or self._place is _Place.OFF_TRACK:
            self._leg = self._detour(body, closest)
        return self._leg

    def _take(self, setpoint: Setpoint) -> bool:
        """Read the setpoint when it is another: without a start it is flown to from anywhere, and there is no line."""
        target = (setpoint.north_m, setpoint.east_m, setpoint.up_m)
        ends = (target, setpoint.previous is None, setpoint.next is None)
        known = self._known
        if known is not None and known[1:] == ends[1:] and math.dist(known[0], target) < SAME_M:
            return False
        self._known = ends
        start = target if setpoint.previous is None else (*setpoint.previous, setpoint.previous_up_m)
        after = target
        if setpoint.next is not None and setpoint.kind not in STOPS:
            after = (*setpoint.next, setpoint.next_up_m)
        self._given = Leg(start, target, after, setpoint.acceptance_radius_m)
        return True

    def _where(self, body: Point) -> tuple[_Place, Point]:
        """Seen from above, with the point of the line that is closest to the vehicle."""
        given, radius_m = self._given, self._given.acceptance_radius_m
        along = (given.target[0] - given.start[0], given.target[1] - given.start[1])
        length_m = math.hypot(*along)
        if length_m < SAME_M:
            return _Place.ON_TRACK, given.target
        unit = (along[0] / length_m, along[1] / length_m)
        gone = (body[0] - given.start[0], body[1] - given.start[1])
        gone_m = gone[0] * unit[0] + gone[1] * unit[1]
        closest = (given.start[0] + unit[0] * gone_m, given.start[1] + unit[1] * gone_m, given.target[2])
        if gone_m > length_m:
            return _Place.TARGET_BEHIND, closest
        if gone_m < 0.0 and math.hypot(*gone) > radius_m:
            return _Place.START_AHEAD, closest
        beside_m = math.dist(body[:2], closest[:2])
        return (_Place.OFF_TRACK if beside_m > radius_m else _Place.ON_TRACK), closest

    def _detour(self, body: Point, closest: Point) -> Leg:
        given, radius_m = self._given, self._given.acceptance_radius_m
        if self._place is _Place.TARGET_BEHIND:
            return Leg(body, given.target, given.after, radius_m)
        if self._place is _Place.START_AHEAD:
            return Leg(body, given.start, given.target, radius_m)
        if self._place is _Place.OFF_TRACK:
            return Leg(body, closest, given.target, radius_m)
        return given


LAND_CRAWL_M = 0.6
LAND_CRAWL_M_S = 0.3


class FlightTask:
    """PX4's FlightTaskAuto: from the navigator's setpoint to a smooth trajectory; `axes` is where it is now."""

    def __init__(self, params: Params) -> None:
        self._params = params
        self._track = FlightTrack()
        self._smoothing = PositionSmoothing(params)

    @property
    def axes(self) -> tuple[VelocitySmoothing, VelocitySmoothing, VelocitySmoothing]:
        """North, east and up."""
        return self._smoothing.axes

    def reset(self, body: Body) -> None:
        """Begin where the body is, as fast as it is."""
        self._track.reset()
        velocity = (body.v_north_m_s, body.v_east_m_s, body.v_up_m_s)
        self._smoothing.reset((body.north_m, body.east_m, body.up_m), velocity)

    def step(self, body: Body, setpoint: Setpoint, dt_s: float) -> None:
        """Move the trajectory on towards the setpoint."""
        here = (body.north_m, body.east_m, body.up_m)
        leg = self._leg(here, setpoint)
        landing = setpoint.kind in (SetpointKind.LAND, SetpointKind.DESCEND)
        self._limit_climb(body, setpoint, landing)
        cruise = setpoint.cruise_speed_m_s
        if not cruise > 0.0:
            cruise = float(self._params["MPC_XY_CRUISE"])
        cruise = min(cruise, float(self._params["MPC_XY_VEL_MAX"]))
        self._smoothing.step(here, leg, cruise, self._land_speed(body.up_m, setpoint) if landing else None, dt_s)
        if setpoint.kind is SetpointKind.VELOCITY:
            parts = zip(self.axes, here, setpoint.velocity, setpoint.acceleration, strict=False)
            for axis, place_m, velocity, acceleration in parts:
                axis.reset(place_m, velocity, acceleration)

    def climb_at(self, acceleration_m_s2: float) -> None:
        """It lifts off with its way up well ahead of it."""
        up = self._smoothing.axes[2]
        up.acceleration_m_s2 = min(acceleration_m_s2, float(self._params["MPC_ACC_UP_MAX"]))

    def _leg(self, here: Point, setpoint: Setpoint) -> Leg:
        if setpoint.kind is not SetpointKind.VELOCITY:
            return self._track.leg(here, setpoint)
        self._track.reset()
        above = (here[0], here[1], setpoint.up_m)
        return Leg(here, above, above, setpoint.acceptance_radius_m)

    def _limit_climb(self, body: Body, setpoint: Setpoint, landing: bool) -> None:
        """Downwards, upwards, or slower in the first metres of a takeoff."""
        params, up = self._params, self._smoothing.axes[2]
        if landing or setpoint.up_m < up.position_m:
            up.max_velocity_m_s = float(params["MPC_Z_V_AUTO_DN"])
            up.max_acceleration_m_s2 = float(params["MPC_ACC_DOWN_MAX"])
            return
        up.max_velocity_m_s = float(params["MPC_Z_V_AUTO_UP"])
        up.max_acceleration_m_s2 = float(params["MPC_ACC_UP_MAX"])
        if setpoint.kind is SetpointKind.TAKEOFF and body.up_m < float(params["MPC_LAND_ALT1"]):
            speed = float(params["MPC_TKO_SPEED"])
            up.max_velocity_m_s = speed
            up.max_acceleration_m_s2 = min(up.max_acceleration_m_s2, speed / float(params["MPC_TKO_RAMP_T"]))
            up.position_m = body.up_m

    def _land_speed(self, height_m: float, setpoint: Setpoint) -> float:
        params = self._params
        if setpoint.kind is SetpointKind.DESCEND:  # it may not trust its height above the ground
            return float(params["MPC_LAND_SPEED"])
        high, low = float(params["MPC_LAND_ALT1"]), float(params["MPC_LAND_ALT2"])
        fast, slow = float(params["MPC_Z_V_AUTO_DN"]), float(params["MPC_LAND_SPEED"])
        if height_m < LAND_CRAWL_M:
            return LAND_CRAWL_M_S
        share = max(0.0, min(1.0, (height_m - low) / max(high - low, 0.1)))
        return slow + share * (fast - slow)


YAW_DISTANCE_M = 2.0
YAW_RATE_RAD_S = math.radians(60.0)  # MPC_YAWRAUTO_MAX
YAW_ACCELERATION_RAD_S2 = math.radians(20.0)  # MPC_YAWRAUTO_ACC
TAKEOFF_RISE_M = 0.1
THROTTLE_PER_M_S = 0.05
STAYS_DOWN = (SetpointKind.IDLE, SetpointKind.LAND, SetpointKind.DESCEND)


class Multicopter:
    """Dynamics of quads, hexas and hovering VTOLs."""

    def __init__(
        self, params: Params, status: Status, hover_throttle: float, control: WingedControl | None = None
    ) -> None:
        self._params = params
        self._hover_throttle = hover_throttle
        self._ground = GroundThrust(params, status, hover_throttle)
        self._task = FlightTask(params)
        self._control = control or PositionControl(params)
        self._flying = False
        self._yaw_rate_rad_s = 0.0

    def reset(self, body: Body) -> None:
        """Take over a body in any state (after a transition, a reboot or on the ground)."""
        self._task.reset(body)
        self._control.reset()
        self._yaw_rate_rad_s = 0.0
        self._flying = not body.on_ground
        self._ground.restart()

    def step(self, body: Body, setpoint: Setpoint, dt_s: float, wind: Wind) -> None:
        """Advance by `dt_s`; the vehicle is armed."""
        if not self._flying:
            self._stand(body, setpoint, dt_s)
            return
        self._control.step(
            body, self._axes(body, setpoint, dt_s), dt_s, wind, level=setpoint.kind is SetpointKind.DESCEND
        )
        body.throttle = max(0.1, min(1.0, self._hover_throttle + THROTTLE_PER_M_S * body.v_up_m_s))
        self._turn(body, setpoint, dt_s)
        if body.up_m <= 0.0 and body.climb_command_m_s < 0.0:
            self._touch_down(body)

    def transition(self, wanted: int) -> None:
        """No VTOL."""

    def _axes(self, body: Body, setpoint: Setpoint, dt_s: float) -> Sequence[Axis]:
        """What the controller follows: the flight task's way, or what comes from outside."""
        if setpoint.kind is SetpointKind.TRAJECTORY:
            self._task.reset(body)  # a mode that comes after it begins here
            return setpoint.axes
        self._task.step(body, setpoint, dt_s)
        return self._task.axes

    def _stand(self, body: Body, setpoint: Setpoint, dt_s: float) -> None:
        """On the ground: the motors spin up to a takeoff, or push down until the landing is detected."""
        wants_up = setpoint.kind not in STAYS_DOWN and setpoint.up_m > body.up_m + TAKEOFF_RISE_M
        body.climb_command_m_s = float(self._params["MPC_TKO_SPEED"]) if wants_up else -LAND_CRAWL_M_S
        takes_off = setpoint.kind is not SetpointKind.POSITION
        body.throttle = self._ground.step(body.throttle, body.climb_command_m_s, dt_s, takes_off=takes_off)
        if wants_up and body.throttle >= self._hover_throttle:
            self.reset(body)
            if not takes_off:
                self._task.climb_at(self._ground.climb_ramp_m_s2)
            self._flying = True
            body.up_m = 0.02

    def _touch_down(self, body: Body) -> None:
        body.up_m = body.v_up_m_s = body.v_north_m_s = body.v_east_m_s = 0.0
        body.roll_rad = body.pitch_rad = 0.0
        self._flying = False
        self._ground.touch_down()

    def _turn(self, body: Body, setpoint: Setpoint, dt_s: float) -> None:
        """To the heading asked for, else along the track (MPC_YAW_MODE 0) while the target is far enough away."""
        to_target = (setpoint.north_m - body.north_m, setpoint.east_m - body.east_m)
        wanted = setpoint.yaw_rad
        travelling = setpoint.kind in (SetpointKind.POSITION, SetpointKind.LOITER)
        if math.isnan(wanted) and travelling and math.hypot(*to_target) > YAW_DISTANCE_M:
            wanted = math.atan2(to_target[1], to_target[0])
        missing = wrap_pi(wanted - body.yaw_rad) if math.isfinite(wanted) else 0.0
        fastest = min(YAW_RATE_RAD_S, math.sqrt(2.0 * YAW_ACCELERATION_RAD_S2 * abs(missing)), abs(missing) / dt_s)
        change = YAW_ACCELERATION_RAD_S2 * dt_s
        rate = math.copysign(fastest, missing)
        self._yaw_rate_rad_s += max(-change, min(change, rate - self._yaw_rate_rad_s))
        body.yaw_rad = wrap_pi(body.yaw_rad + self._yaw_rate_rad_s * dt_s)
