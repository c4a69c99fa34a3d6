"""OFFBOARD: turns the newest setpoint into what the dynamics follow, by what each vehicle type makes of it."""

from __future__ import annotations

import math

from app.simulator.clock import VehicleClock
from app.simulator.geo import wrap_pi
from app.simulator.navigator.context import NavContext
from app.simulator.offboard.receiver import OffboardStream, OffboardTarget, Vector
from app.simulator.setpoint import AxisSetpoint, SetpointKind

AHEAD_M = 1000.0
"""A velocity or a course is flown towards a point this far away, renewed all the time."""
STANDSTILL_M_S = 0.05
GRAVITY_M_S2 = 9.81
CLIMB_PER_THRUST_M_S = 10.0
CLIMB_LOOKAHEAD_S = 2.0
NOT_GIVEN: Vector = (math.nan, math.nan, math.nan)


class OffboardMode:
    """A flight mode. What a type does not follow leaves it holding (hovering, standing) or flying straight on."""

    def __init__(self, context: NavContext, stream: OffboardStream) -> None:
        self._context = context
        self._stream = stream
        self._held: tuple[float, float] = (0.0, 0.0)
        self._held_up_m = 0.0
        self._held_course_rad = 0.0
        self._followed: OffboardTarget | None = None

    def activate(self) -> None:
        body = self._context.state.body
        self._followed = None
        self._hold_here()
        self._held_course_rad = math.atan2(body.v_east_m_s, body.v_north_m_s)

    def step(self) -> None:
        target = self._stream.newest
        if target is None:
            return
        changed = self._followed is None or _kind(target) != _kind(self._followed)
        self._followed = target
        if changed:
            self._hold_here()
        if self._context.flies_like_plane:
            self._fly_wing(target)
        elif self._context.hovers:
            self._hover(target)
        else:
            self._head_on(target)

    def _hold_here(self) -> None:
        self._held = self._context.stop_point()
        self._held_up_m = self._context.state.body.up_m

    # by vehicle type ----------------------------------------------------------------------------------------

    def _hover(self, target: OffboardTarget) -> None:
        """Position, velocity, acceleration, all that is given: straight to the controller. A tilt accelerates."""
        position, velocity = target.position or NOT_GIVEN, target.velocity or NOT_GIVEN
        acceleration = target.acceleration or NOT_GIVEN
        if target.thrust is not None:
            velocity, acceleration = self._tilted(target, target.thrust)
        axes = tuple(
            AxisSetpoint(place, rate, gain)
            if math.isfinite(place) or math.isfinite(rate) or math.isfinite(gain)
            else AxisSetpoint(held)  # PX4 wants every axis, and stops for a setpoint that leaves one out
            for place, rate, gain, held in zip(position, velocity, acceleration, self._held_place, strict=True)
        )
        setpoint = self._context.set_point(
            SetpointKind.TRAJECTORY,
            (_either(position[0], self._held[0]), _either(position[1], self._held[1])),
            _either(position[2], self._leads_up_to(velocity[2], acceleration[2])),
        )
        setpoint.axes = (axes[0], axes[1], axes[2])
        setpoint.yaw_rad = target.yaw_rad

    def _leads_up_to(self, up_m_s: float, up_m_s2: float) -> float:
        """A height for those who look at the setpoint: above the vehicle if it is to climb."""
        up = _either(up_m_s, up_m_s2)
        return self._held_up_m if math.isnan(up) else self._context.state.body.up_m + up * CLIMB_LOOKAHEAD_S

    def _head_on(self, target: OffboardTarget) -> None:
        """Rover and airship: position, else velocity, none stops. An attitude does nothing [21_offboard_rover]."""
        position, velocity = target.position or NOT_GIVEN, target.velocity or NOT_GIVEN
        up_m = 0.0 if self._context.airframe.is_rover else _either(position[2], self._held_up_m)
        if _is_placed(position):
            self._context.set_point(SetpointKind.POSITION, (position[0], position[1]), up_m)
        else:
            self._go_on(_either(velocity[0], 0.0), _either(velocity[1], 0.0), up_m)

    def _fly_wing(self, target: OffboardTarget) -> None:
        """Position with velocity is a path point and its tangent. Position alone: due north, at its height.

        Velocity of zero with a position keeps the course; so does all else [20_offboard_plane, 20b]. Attitude: the
        bank turns the course, the pitch climbs; thrust and rates are not modelled.
        """
        position, velocity = target.position, target.velocity
        if target.is_attitude:
            self._bank(*target.tilt_rad)
        up_m = self._held_up_m if position is None or math.isnan(position[2]) else position[2]
        moving = velocity is not None and math.hypot(velocity[0], velocity[1]) > STANDSTILL_M_S
        placed = position is not None and _is_placed(position)
        if placed and position is not None and velocity is not None and moving:
            self._follow_line((position[0], position[1]), math.atan2(velocity[1], velocity[0]), up_m)
            return
        due_north = placed and velocity is None
        body = self._context.state.body
        self._follow_line((body.north_m, body.east_m), 0.0 if due_north else self._held_course_rad, up_m)

    def _bank(self, roll_rad: float, pitch_rad: float) -> None:
        speed = max(self._context.state.body.ground_speed_m_s, 1.0)
        turned = GRAVITY_M_S2 * math.tan(roll_rad) / speed * VehicleClock.STEP_S
        self._held_course_rad = wrap_pi(self._held_course_rad + turned)
        self._held_up_m += speed * math.sin(pitch_rad) * VehicleClock.STEP_S

    # setpoints ----------------------------------------------------------------------------------------------

    def _go_on(self, north: float, east: float, up_m: float) -> None:
        """With a velocity: towards a point far ahead, renewed all the time."""
        body, speed = self._context.state.body, math.hypot(north, east)
        if speed <= STANDSTILL_M_S:
            self._context.set_point(SetpointKind.POSITION, self._held, up_m)
            return
        self._held = self._context.stop_point()
        point = (body.north_m + north / speed * AHEAD_M, body.east_m + east / speed * AHEAD_M)
        self._context.set_point(SetpointKind.POSITION, point, up_m).cruise_speed_m_s = speed

    def _tilted(self, target: OffboardTarget, thrust: float) -> tuple[Vector, Vector]:
        """Velocity and acceleration that an attitude and a thrust make."""
        roll, pitch = target.tilt_rad
        yaw = self._context.state.body.yaw_rad
        ahead, right = (math.tan(angle) * GRAVITY_M_S2 for angle in (-pitch, roll))
        north, east = ahead * math.cos(yaw) - right * math.sin(yaw), ahead * math.sin(yaw) + right * math.cos(yaw)
        climb = (thrust - self._context.airframe.hover_throttle) * CLIMB_PER_THRUST_M_S
        return (math.nan, math.nan, climb), (north, east, math.nan)

    @property
    def _held_place(self) -> Vector:
        return self._held[0], self._held[1], self._held_up_m

    def _follow_line(self, through: tuple[float, float], course_rad: float, up_m: float) -> None:
        north, east = AHEAD_M * math.cos(course_rad), AHEAD_M * math.sin(course_rad)
        body = self._context.state.body
        along_m = (body.north_m - through[0]) * north / AHEAD_M + (body.east_m - through[1]) * east / AHEAD_M
        start = (through[0] + north * (along_m / AHEAD_M - 1.0), through[1] + east * (along_m / AHEAD_M - 1.0))
        end = (start[0] + 2.0 * north, start[1] + 2.0 * east)
        self._context.set_point(SetpointKind.POSITION, end, up_m, previous=start, next_point=end)


def _kind(target: OffboardTarget) -> tuple[bool, ...]:
    """Which parts are given, axis by axis."""
    vectors = (target.position or NOT_GIVEN) + (target.velocity or NOT_GIVEN) + (target.acceleration or NOT_GIVEN)
    return (target.is_attitude, *map(math.isnan, vectors))


def _is_placed(position: Vector) -> bool:
    return math.isfinite(position[0]) and math.isfinite(position[1])


def _either(wanted: float, otherwise: float) -> float:
    return otherwise if math.isnan(wanted) else wanted
