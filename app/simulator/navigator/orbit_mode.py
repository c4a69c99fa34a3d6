"""Orbit (FlightTaskOrbit): a multicopter flies straight to the circle and then around it, nose to the centre."""

from __future__ import annotations

import math
from dataclasses import dataclass

from app.simulator.navigator.context import NavContext
from app.simulator.setpoint import SetpointKind
from app.simulator.state import OrbitStatus
from app.simulator.wire import Severity

RADIUS_MIN_M, RADIUS_MAX_M = 1.0, 1000.0  # MC_ORBIT_RAD_MAX
SPEED_MAX_M_S = 10.0
ACCELERATION_MAX_M_S2 = 2.0
ON_CIRCLE_M = 2.0
HOLD_HEADING, UNCONTROLLED, TANGENT = 1, 2, 3
"""ORBIT_YAW_BEHAVIOUR; all else looks at the centre."""


@dataclass(frozen=True, slots=True)
class OrbitCommand:
    """DO_ORBIT. NaN, and None for the centre, keep what was. A negative radius is counter-clockwise."""

    radius_m: float
    speed_m_s: float
    yaw_behaviour: float
    centre: tuple[float, float] | None
    up_m: float


class OrbitMode:
    """`command` takes effect in the next cycle. What does not hover stays where it is."""

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._wanted: OrbitCommand | None = None
        self._centre = (0.0, 0.0)
        self._up_m = 0.0
        self._radius_m = RADIUS_MIN_M
        self._speed_m_s = 1.0
        """Positive is clockwise, seen from above."""
        self._yaw_behaviour = 0
        self._first_yaw_rad = 0.0
        self._approaching = True

    @property
    def status(self) -> OrbitStatus:
        return OrbitStatus(math.copysign(self._radius_m, self._speed_m_s), self._centre, self._up_m)

    def command(self, wanted: OrbitCommand) -> None:
        """Also before the mode is entered."""
        self._wanted = wanted

    def activate(self) -> None:
        context, body = self._context, self._context.state.body
        self._centre, self._up_m = (body.north_m, body.east_m), body.up_m
        self._radius_m, self._speed_m_s = RADIUS_MIN_M, 1.0
        self._yaw_behaviour, self._first_yaw_rad = 0, body.yaw_rad
        self._approaching = True
        if not context.hovers:
            context.set_point(SetpointKind.LOITER, context.stop_point(), body.up_m)

    def step(self) -> None:
        if self._wanted is not None:
            self._apply(self._wanted)
            self._wanted = None
        if not self._context.hovers:
            return
        if self._on_circle():
            self._approaching = False
        if self._approaching:
            self._approach()
        else:
            self._circle()

    def _apply(self, wanted: OrbitCommand) -> None:
        radius_m, speed_m_s = self._radius_m, abs(self._speed_m_s)
        clockwise = self._speed_m_s > 0.0
        if math.isfinite(wanted.radius_m):
            radius_m, clockwise = abs(wanted.radius_m), wanted.radius_m > 0.0
        if math.isfinite(wanted.speed_m_s):
            speed_m_s = wanted.speed_m_s
        if RADIUS_MIN_M <= radius_m <= RADIUS_MAX_M:
            self._radius_m = radius_m
            fastest = min(SPEED_MAX_M_S, math.sqrt(ACCELERATION_MAX_M_S2 * radius_m))
            self._speed_m_s = max(-fastest, min(fastest, speed_m_s if clockwise else -speed_m_s))
        else:
            self._context.text(Severity.ALERT, "Orbit radius limit exceeded")
        if math.isfinite(wanted.yaw_behaviour):
            self._yaw_behaviour = int(wanted.yaw_behaviour)
        self._first_yaw_rad = self._context.state.body.yaw_rad
        self._centre = wanted.centre or self._centre
        if math.isfinite(wanted.up_m):
            self._up_m = wanted.up_m
        self._approaching = not self._on_circle()

    def _from_centre(self) -> tuple[float, float, float]:
        """Distance, and the unit vector outwards."""
        body = self._context.state.body
        north_m, east_m = body.north_m - self._centre[0], body.east_m - self._centre[1]
        distance_m = math.hypot(north_m, east_m)
        if distance_m < 1e-6:
            return 0.0, 1.0, 0.0  # a real one drifts off its centre somehow
        return distance_m, north_m / distance_m, east_m / distance_m

    def _on_circle(self) -> bool:
        context = self._context
        high = abs(context.state.body.up_m - self._up_m) >= float(context.params["NAV_MC_ALT_RAD"])
        return not high and abs(self._from_centre()[0] - self._radius_m) < ON_CIRCLE_M

    def _approach(self) -> None:
        """The shortest way, at MPC_XY_CRUISE whatever speed was commanded before."""
        _, north, east = self._from_centre()
        point = (self._centre[0] + self._radius_m * north, self._centre[1] + self._radius_m * east)
        setpoint = self._context.set_point(SetpointKind.POSITION, point, self._up_m, acceptance_radius_m=ON_CIRCLE_M)
        setpoint.cruise_speed_m_s = math.nan
        setpoint.yaw_rad = math.atan2(-east, -north)

    def _circle(self) -> None:
        """Along the tangent, and back to the radius by a metre a second for each metre."""
        distance_m, north, east = self._from_centre()
        speed, back = self._speed_m_s, self._radius_m - distance_m
        inwards = speed * speed / self._radius_m
        body = self._context.state.body
        setpoint = self._context.set_point(SetpointKind.VELOCITY, (body.north_m, body.east_m), self._up_m)
        setpoint.velocity = (-east * speed + north * back, north * speed + east * back)
        setpoint.acceleration = (-north * inwards, -east * inwards)
        if self._yaw_behaviour == HOLD_HEADING:
            setpoint.yaw_rad = self._first_yaw_rad
        elif self._yaw_behaviour == TANGENT:
            setpoint.yaw_rad = math.atan2(north * speed, -east * speed)
        elif self._yaw_behaviour != UNCONTROLLED:
            setpoint.yaw_rad = math.atan2(-east, -north)
