"""PX4's PositionSmoothing: which velocity leads a multicopter to its point, and the trajectory that follows from it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from app.simulator.params import Params


def speed_to_stop_m_s(distance_m: float, acceleration_m_s2: float, jerk_m_s3: float, final_m_s: float = 0.0) -> float:
    """Highest speed from which one still slows to `final_m_s` within `distance_m` (computeMaxSpeedFromDistance)."""
    b = 4.0 * acceleration_m_s2**2 / jerk_m_s3
    c = -2.0 * acceleration_m_s2 * max(distance_m, 0.0) - final_m_s**2
    return max(0.5 * (-b + math.sqrt(b * b - 4.0 * c)), final_m_s)


def stopping_distance_m(speed_m_s: float, acceleration_m_s2: float, jerk_m_s3: float) -> float:
    """How far ahead a vehicle that is commanded to hold will come to rest (computeBrakingDistanceFromVelocity)."""
    return speed_m_s * (speed_m_s / (2.0 * acceleration_m_s2) + acceleration_m_s2 / jerk_m_s3)


def speed_in_turn_m_s(
    before: tuple[float, float],
    at: tuple[float, float],
    after: tuple[float, float],
    acceleration_m_s2: float,
    radius_m: float,
) -> float:
    """Speed at which a multicopter may pass a corner of its track (computeMaxSpeedInWaypoint)."""
    to_before = (before[0] - at[0], before[1] - at[1])
    to_after = (after[0] - at[0], after[1] - at[1])
    lengths = math.hypot(*to_before) * math.hypot(*to_after)
    if lengths < 1e-6:
        return 0.0
    cosine = (to_before[0] * to_after[0] + to_before[1] * to_after[1]) / lengths
    angle = math.acos(max(-1.0, min(1.0, cosine)))
    if angle > math.pi - 1e-3:
        return math.inf
    return math.sqrt(acceleration_m_s2 * radius_m * math.tan(angle / 2.0))


# One axis of a jerk-limited trajectory towards a velocity (PX4's VelocitySmoothing).
#
# The way there has three parts: the acceleration grows, stays, and goes back to zero; each is given by its duration.


TINY = 1e-7


@dataclass(slots=True)
class VelocitySmoothing:
    """`advance` moves along the plan, `plan` makes the next one, from the state reached."""

    max_jerk_m_s3: float = 4.0
    max_acceleration_m_s2: float = 0.0
    max_velocity_m_s: float = 0.0
    position_m: float = 0.0
    velocity_m_s: float = 0.0
    acceleration_m_s2: float = 0.0
    _goal_m_s: float = 0.0
    _direction: float = 0.0
    _growing_s: float = 0.0
    _steady_s: float = 0.0
    _falling_s: float = 0.0

    @property
    def duration_s(self) -> float:
        """Until the wanted velocity is reached."""
        return self._growing_s + self._steady_s + self._falling_s

    def reset(self, position_m: float, velocity_m_s: float = 0.0, acceleration_m_s2: float = 0.0) -> None:
        """Begin anew in this state."""
        self.position_m, self.velocity_m_s, self.acceleration_m_s2 = position_m, velocity_m_s, acceleration_m_s2
        self._growing_s = self._steady_s = self._falling_s = 0.0

    def advance(self, dt_s: float) -> None:
        """Move by `dt_s` along the plan made last; one `plan` allows one `advance`."""
        if self._direction == 0.0:
            self.position_m += self.velocity_m_s * dt_s
            return
        jerk = self._direction * self.max_jerk_m_s3
        for duration_s, part_jerk in ((self._growing_s, jerk), (self._steady_s, 0.0), (self._falling_s, -jerk)):
            if duration_s > 0.0:
                part_s = duration_s if duration_s < dt_s else dt_s
                self._move(part_s, part_jerk)
                dt_s -= part_s
                if dt_s <= 0.0:
                    return
        self.acceleration_m_s2 = 0.0
        self.position_m += self.velocity_m_s * dt_s

    def _move(self, t_s: float, jerk: float) -> None:
        acceleration, velocity = self.acceleration_m_s2, self.velocity_m_s
        self.acceleration_m_s2 = acceleration + jerk * t_s
        self.velocity_m_s = velocity + acceleration * t_s + jerk * t_s * t_s / 2.0
        self.position_m += velocity * t_s + acceleration * t_s * t_s / 2.0 + jerk * t_s**3 / 6.0

    def plan(self, velocity_m_s: float) -> None:
        """The quickest way to `velocity_m_s`."""
        limit = self.max_velocity_m_s
        self._goal_m_s = limit if velocity_m_s > limit else -limit if velocity_m_s < -limit else velocity_m_s
        self._direction = self._first_direction()
        if self._direction == 0.0:
            self._growing_s = self._steady_s = self._falling_s = 0.0
            return
        jerk, start = self._direction * self.max_jerk_m_s3, self.acceleration_m_s2
        missing = self._goal_m_s - self.velocity_m_s
        growing_s = 0.0
        under_root = 2.0 * start * start + 4.0 * jerk * missing
        if under_root >= 0.0:
            half = math.sqrt(under_root) / 2.0
            for candidate in ((half - start) / jerk, (-half - start) / jerk):
                if candidate >= 0.0 and start / jerk + candidate >= 0.0:
                    growing_s = candidate
                    break
        self._growing_s = max(self._within_acceleration(growing_s, jerk), 0.0)
        self._falling_s = max(start / jerk + self._growing_s, 0.0)
        top = start + jerk * self._growing_s
        self._steady_s = 0.0
        if abs(top) > TINY:
            gained = (start + top) / 2.0 * self._growing_s + top * self._falling_s - jerk * self._falling_s**2 / 2.0
            self._steady_s = max((missing - gained) / top, 0.0)

    def last(self, total_s: float) -> None:
        """Take `total_s` for it instead, with less acceleration."""
        if self._direction == 0.0:
            return
        jerk, start = self._direction * self.max_jerk_m_s3, self.acceleration_m_s2
        missing = self._goal_m_s - self.velocity_m_s
        rest = jerk * total_s - start
        under_root = (total_s * jerk) ** 2 + 2.0 * total_s * start * jerk - start * start - 4.0 * jerk * missing
        growing_s = 0.0
        if under_root >= 0.0:
            root = math.sqrt(under_root)
            for candidate in (max((rest - root) / (2.0 * jerk), 0.0), max((rest + root) / (2.0 * jerk), 0.0)):
                falling_s = start / jerk + candidate
                if falling_s >= 0.0 and candidate + falling_s <= total_s:
                    growing_s = candidate
                    break
            growing_s = self._within_acceleration(growing_s, jerk)
        self._growing_s = growing_s
        self._falling_s = max(start / jerk + growing_s, 0.0)
        self._steady_s = max(total_s - self._growing_s - self._falling_s, 0.0)

    def _first_direction(self) -> float:
        """Up or down first: by the velocity that would be left if the acceleration were taken back at once."""
        acceleration = self.acceleration_m_s2
        left = self._goal_m_s - self.velocity_m_s - acceleration * abs(acceleration) / (2.0 * self.max_jerk_m_s3)
        if left > TINY or left < -TINY:
            return 1.0 if left > 0.0 else -1.0
        if -TINY < acceleration < TINY:
            return 0.0
        return 1.0 if acceleration > 0.0 else -1.0

    def _within_acceleration(self, growing_s: float, jerk: float) -> float:
        top, limit = self.acceleration_m_s2 + jerk * growing_s, self.max_acceleration_m_s2
        if abs(top) <= limit:
            return growing_s
        return (math.copysign(limit, top) - self.acceleration_m_s2) / jerk


def synchronize(axes: Sequence[VelocitySmoothing]) -> None:
    """All axes take as long as the slowest, so that the track is straight (timeSynchronization)."""
    durations_s = [axis.duration_s for axis in axes]
    longest_s = max(durations_s)
    if longest_s <= TINY:
        return
    for axis, duration_s in zip(axes, durations_s, strict=True):
        if duration_s < longest_s:
            axis.last(longest_s)


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
