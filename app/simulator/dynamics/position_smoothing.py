"""PX4's PositionSmoothing: which velocity leads a multicopter to its point, and the trajectory that follows from it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from app.simulator.dynamics.trajectory import speed_in_turn_m_s, speed_to_stop_m_s
from app.simulator.dynamics.velocity_smoothing import VelocitySmoothing, synchronize
from app.simulator.params import Params

Point = tuple[float, float, float]
"""North, east, up."""

TURN_COSINE = 0.98
TURN_SPEED_M_S = 0.2
SHORTEST_LOOKAHEAD_M = 5.0
SAME_M = 0.001


@dataclass(frozen=True, slots=True)
class Leg:
    """The way as the flight task sees it: from `start` over `target` to `after`, which is `target` to stop there."""

    start: Point
    target: Point
    after: Point
    acceptance_radius_m: float


class PositionSmoothing:
    """Three axes, north, east and up, of one trajectory. The owner sets the vertical limits."""

    def __init__(self, params: Params) -> None:
        self._params = params
        self.axes = (VelocitySmoothing(), VelocitySmoothing(), VelocitySmoothing())
        self._acceleration = self._jerk = 0.0
        self._speed_before_turn_m_s = 0.0

    @property
    def position(self) -> Point:
        """Where the trajectory is."""
        north, east, up = self.axes
        return north.position_m, east.position_m, up.position_m

    def reset(self, position: Point, velocity: Point) -> None:
        """Begin in this state."""
        for axis, place, speed in zip(self.axes, position, velocity, strict=True):
            axis.reset(place, speed)
        self._speed_before_turn_m_s = 0.0

    def step(self, body: Point, leg: Leg, cruise_m_s: float, descent_m_s: float | None, dt_s: float) -> None:
        """One cycle. `descent_m_s` is given in a landing: the height of the target does not count then."""
        self._limit()
        north, east, up = self._velocity(leg, cruise_m_s, descent_m_s)
        flat_s, up_s = dt_s * self._time_stretch(body), dt_s * self._height_stretch(body)
        for axis, velocity, passed_s in zip(self.axes, (north, east, up), (flat_s, flat_s, up_s), strict=True):
            axis.advance(passed_s)
            axis.plan(velocity)
        synchronize(self.axes)

    def _limit(self) -> None:
        """Parameters may change in flight."""
        params = self._params
        self._acceleration, self._jerk = float(params["MPC_ACC_HOR"]), float(params["MPC_JERK_AUTO"])
        north, east, up = self.axes
        north.max_jerk_m_s3 = east.max_jerk_m_s3 = up.max_jerk_m_s3 = self._jerk
        north.max_velocity_m_s = east.max_velocity_m_s = float(params["MPC_XY_VEL_MAX"])
        north.max_acceleration_m_s2 = east.max_acceleration_m_s2 = self._acceleration

    def _time_stretch(self, body: Point) -> float:
        """The trajectory waits for a vehicle that is behind it (MPC_XY_ERR_MAX)."""
        north, east, _ = self.axes
        ahead = (north.position_m - body[0], east.position_m - body[1])
        if ahead[0] * north.velocity_m_s + ahead[1] * east.velocity_m_s < 0.0:
            return 1.0
        return 1.0 - min(math.hypot(*ahead) / float(self._params["MPC_XY_ERR_MAX"]), 1.0)

    def _height_stretch(self, body: Point) -> float:
        """The same for the height (MPC_Z_ERR_MAX), each by itself."""
        up = self.axes[2]
        ahead_m = up.position_m - body[2]
        if ahead_m * up.velocity_m_s < 0.0:
            return 1.0
        return 1.0 - min(abs(ahead_m) / float(self._params["MPC_Z_ERR_MAX"]), 1.0)

    def _velocity(self, leg: Leg, cruise_m_s: float, descent_m_s: float | None) -> Point:
        here = self.position
        turning = self._turning(leg)
        to = self._point_on_line(leg) if turning else leg.target[:2]
        speed = self._speed(leg, cruise_m_s)
        if turning:
            speed = min(speed, self._speed_before_turn_m_s)
        else:
            self._speed_before_turn_m_s = speed
        way = (to[0] - here[0], to[1] - here[1], leg.target[2] - here[2])
        flat_m = math.hypot(way[0], way[1]) or math.inf
        up = math.copysign(self._climb(leg), way[2]) if descent_m_s is None else -descent_m_s
        return way[0] / flat_m * speed, way[1] / flat_m * speed, up

    def _turning(self, leg: Leg) -> bool:
        """Flies more than 11 degrees off the target, and is not yet there."""
        north, east, _ = self.axes
        speed = math.hypot(north.velocity_m_s, east.velocity_m_s)
        way = (leg.target[0] - north.position_m, leg.target[1] - east.position_m)
        distance_m = math.hypot(*way)
        if speed <= TURN_SPEED_M_S or distance_m <= leg.acceptance_radius_m:
            return False
        cosine = (north.velocity_m_s * way[0] + east.velocity_m_s * way[1]) / (speed * distance_m)
        return cosine < TURN_COSINE

    def _point_on_line(self, leg: Leg) -> tuple[float, float]:
        """In a turn the trajectory joins the line to the target some metres ahead (an L1 distance), seen from above."""
        here, start = self.position, leg.start
        along = (leg.target[0] - start[0], leg.target[1] - start[1])
        length_m = math.hypot(*along) or math.inf
        unit = (along[0] / length_m, along[1] / length_m)
        passed_m = (here[0] - start[0]) * unit[0] + (here[1] - start[1]) * unit[1]
        closest = (start[0] + unit[0] * passed_m, start[1] + unit[1] * passed_m)
        beside_m = math.dist(closest, here[:2])
        lookahead_m = max(leg.acceptance_radius_m, SHORTEST_LOOKAHEAD_M)
        ahead_m = math.sqrt(lookahead_m**2 - beside_m**2) if lookahead_m > beside_m else 0.0
        return closest[0] + ahead_m * unit[0], closest[1] + ahead_m * unit[1]

    def _speed(self, leg: Leg, cruise_m_s: float) -> float:
        """Slow enough to turn at the target and to stop at the point after it."""
        acceleration, jerk = self._acceleration, self._jerk
        here, target, after = self.position[:2], leg.target[:2], leg.after[:2]
        beyond_m = math.dist(target, after)
        there = 0.0
        if beyond_m > SAME_M and beyond_m >= leg.acceptance_radius_m:
            sideways = float(self._params["MPC_XY_TRAJ_P"]) * acceleration
            leaving = min(cruise_m_s, speed_to_stop_m_s(beyond_m, acceleration, jerk))
            turn = speed_in_turn_m_s(here, target, after, sideways, leg.acceptance_radius_m)
            there = min(turn, leaving, cruise_m_s)
        return min(cruise_m_s, speed_to_stop_m_s(math.dist(here, target), acceleration, jerk, there))

    def _climb(self, leg: Leg) -> float:
        """Vertical speed, slow enough for the turn between climbing and descending at the target."""
        axis = self.axes[2]
        here, target, after = self.position, leg.target, leg.after
        there = 0.0
        if abs(target[2] - after[2]) > SAME_M:
            points = [(math.hypot(point[0], point[1]), point[2]) for point in (here, target, after)]
            radius_m = float(self._params["NAV_MC_ALT_RAD"])
            turn = speed_in_turn_m_s(points[0], points[1], points[2], axis.max_acceleration_m_s2, radius_m)
            there = min(turn, axis.max_velocity_m_s)
        distance_m = abs(target[2] - here[2])
        fastest = speed_to_stop_m_s(distance_m, axis.max_acceleration_m_s2, axis.max_jerk_m_s3, there)
        return min(axis.max_velocity_m_s, fastest)
