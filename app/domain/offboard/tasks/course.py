"""The courses of tasks over the ground: a point, a circle, legs. Metres north and east of the EKF origin."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from app.domain.airspace import shapes
from app.domain.errors import SetpointRefusedError
from app.domain.geo import LocalProjection
from app.domain.offboard.limits import OffboardLimits, VehiclePose, limit
from app.domain.offboard.setpoints import MOST_METRES, PositionNed
from app.domain.offboard.tasks.forms import GlobalPoint, LocalPoint, TaskModel
from app.domain.vehicle.state import VehicleState

Ground = tuple[float, float]
"""North, east."""


@dataclass(frozen=True, slots=True)
class Reference:
    """The nearest point of a course, and how it goes on from there.

    `tangent` is a unit vector (zero at a point that is reached). `to_corner_m`: to where it must be slow, with
    `corner_share` of its speed. `cross_m`: how far the vehicle is beside the course; to the right is positive.
    """

    nearest: Ground
    tangent: Ground
    cross_m: float
    remaining_m: float = math.inf
    to_corner_m: float = math.inf
    corner_share: float = 0.0
    leg: int = 0


@dataclass(frozen=True, slots=True)
class Turn:
    """When the end of a leg counts as reached: this time before it, and at most this far beside it. Otherwise the
    vehicle flies to the corner first.
    """

    before_m: float = 0.0
    within_m: float = 2.0


CORNERS: Final = Turn()


@dataclass(frozen=True, slots=True)
class PointCourse:
    """A place, which may move with a velocity since `since_s` (monotonic)."""

    point: Ground
    velocity: Ground = (0.0, 0.0)
    since_s: float = 0.0

    def at(self, now_s: float, longest_s: float) -> PointCourse:
        """Its current position. A target without a report for `longest_s` is assumed to have stopped there."""
        age_s = max(0.0, now_s - self.since_s)
        moving_s = min(age_s, longest_s)
        velocity = self.velocity if age_s <= longest_s else (0.0, 0.0)
        point = (self.point[0] + self.velocity[0] * moving_s, self.point[1] + self.velocity[1] * moving_s)
        return PointCourse(point, velocity, now_s)

    def reference(self, here: Ground, _leg: int = 0, _turn: Turn = CORNERS) -> Reference:
        """Straight there."""
        away = (self.point[0] - here[0], self.point[1] - here[1])
        remaining_m = math.hypot(*away)
        tangent = (away[0] / remaining_m, away[1] / remaining_m) if remaining_m > 0.0 else (0.0, 0.0)
        return Reference(self.point, tangent, 0.0, remaining_m=remaining_m, to_corner_m=remaining_m)


@dataclass(frozen=True, slots=True)
class CircleCourse:
    """A circle; a positive radius is flown clockwise."""

    center: Ground
    radius_m: float

    def reference(self, here: Ground, _leg: int = 0, _turn: Turn = CORNERS) -> Reference:
        """The nearest point of the circle; from its centre, the one in the north."""
        out = (here[0] - self.center[0], here[1] - self.center[1])
        away_m = math.hypot(*out)
        north, east = (out[0] / away_m, out[1] / away_m) if away_m > 1e-6 else (1.0, 0.0)
        radius_m, turn = abs(self.radius_m), math.copysign(1.0, self.radius_m)
        return Reference(
            nearest=(self.center[0] + north * radius_m, self.center[1] + east * radius_m),
            tangent=(-east * turn, north * turn),
            cross_m=-turn * (away_m - radius_m),
        )


@dataclass(frozen=True, slots=True)
class LegsCourse:
    """Straight legs between at least two points, no two neighbours alike."""

    points: tuple[Ground, ...]

    @property
    def last_leg(self) -> int:
        """Its number; the first is 0."""
        return len(self.points) - 2

    def reference(self, here: Ground, leg: int = 0, turn: Turn = CORNERS) -> Reference:
        """The nearest point of the leg that is flown. At its end the next one counts."""
        last = self.last_leg
        while True:
            start, end = self.points[leg], self.points[leg + 1]
            length_m = math.dist(start, end)
            tangent = ((end[0] - start[0]) / length_m, (end[1] - start[1]) / length_m)
            along_m, cross_m = _along(start, tangent, here)
            if leg >= last or along_m < length_m - turn.before_m or abs(cross_m) > turn.within_m:
                break
            leg += 1
        on_leg_m = min(max(0.0, along_m), length_m)
        rest_m = sum(math.dist(*self.points[i : i + 2]) for i in range(leg + 1, last + 1))
        return Reference(
            nearest=(start[0] + tangent[0] * on_leg_m, start[1] + tangent[1] * on_leg_m),
            tangent=tangent,
            cross_m=cross_m,
            remaining_m=length_m - on_leg_m + rest_m,
            to_corner_m=length_m - on_leg_m,
            corner_share=self._corner_share(leg),
            leg=leg,
        )

    def _corner_share(self, leg: int) -> float:
        """Straight on: 1; a right angle, a turn back, and the end: 0."""
        if leg + 2 >= len(self.points):
            return 0.0
        a, b, c = self.points[leg : leg + 3]
        cosine = ((b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1])) / (math.dist(a, b) * math.dist(b, c))
        return max(0.0, cosine)


Course = PointCourse | CircleCourse | LegsCourse


def _along(start: Ground, tangent: Ground, here: Ground) -> Ground:
    """How far along the line, and how far to its right."""
    north, east = here[0] - start[0], here[1] - start[1]
    return north * tangent[0] + east * tangent[1], east * tangent[0] - north * tangent[1]


_ROUNDS: Final = 3
"""The projection around the origin is looked for from the one around home: each round corrects the remaining error."""


@dataclass(frozen=True, slots=True)
class EkfOrigin:
    """From where local coordinates count: degrees, metres AMSL."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float

    @classmethod
    def of(cls, state: VehicleState) -> EkfOrigin | None:
        """From HOME_POSITION, which has home in both frames; None before it was received."""
        home, local = state.home, state.home_ned_m
        if home is None or local is None:
            return None
        north, east, down = local
        latitude, longitude = LocalProjection(home.latitude_deg, home.longitude_deg).to_global(-east, -north)
        for _ in range(_ROUNDS):
            home_east, home_north = LocalProjection(latitude, longitude).to_local(home.latitude_deg, home.longitude_deg)
            latitude, longitude = LocalProjection(latitude, longitude).to_global(home_east - east, home_north - north)
        return cls(latitude, longitude, home.altitude_m + down)

    def ground(self, point: LocalPoint | GlobalPoint) -> Ground:
        """North and east of a point."""
        if isinstance(point, LocalPoint):
            return point.north_m, point.east_m
        east, north = self._projection().to_local(point.latitude_deg, point.longitude_deg)
        return north, east

    def place(self, latitude_deg: float, longitude_deg: float) -> Ground:
        """North and east of a place on earth."""
        east, north = self._projection().to_local(latitude_deg, longitude_deg)
        return north, east

    def up_of(self, task: TaskModel, home_altitude_m: float) -> float | None:
        """The height of the task above the origin; None if it has none. `home_altitude_m`: of home now, AMSL."""
        if task.absolute_altitude_m is not None:
            return task.absolute_altitude_m - self.altitude_m
        if task.relative_altitude_m is None:
            return None
        return home_altitude_m + task.relative_altitude_m - self.altitude_m

    def _projection(self) -> LocalProjection:
        return LocalProjection(self.latitude_deg, self.longitude_deg)


_CORNERS: Final = 24


def refuse_outside(points: tuple[Ground, ...], up_m: float | None, limits: OffboardLimits, where: VehiclePose) -> None:
    """Check whether the whole course is allowed at this height; None: at the current height, which is limited in
    flight.

    Raises:
        SetpointRefusedError: it exceeds a limit, crosses the fence, or is outside the range of a message.
    """
    _refuse_unsayable(points, up_m)
    strict = limits.model_copy(update={"when_exceeded": "refuse"})
    if up_m is None:
        strict = strict.model_copy(update={"min_altitude_m": None, "max_altitude_m": None})
    anywhere = VehiclePose(kind=where.kind, home=where.home, home_ned=where.home_ned)
    for north, east in points:
        down_m = 0.0 if up_m is None else -up_m
        limit(PositionNed(type="position_ned", north_m=north, east_m=east, down_m=down_m), strict, anywhere)
    _refuse_beyond_fence(points, where)


def circle_around(center: Ground, radius_m: float) -> tuple[Ground, ...]:
    """Corners of a polygon outside the circle."""
    outside_m = radius_m / math.cos(math.pi / _CORNERS)
    turns = (2.0 * math.pi * corner / _CORNERS for corner in range(_CORNERS + 1))
    return tuple((center[0] + outside_m * math.cos(turn), center[1] + outside_m * math.sin(turn)) for turn in turns)


def _refuse_unsayable(points: tuple[Ground, ...], up_m: float | None) -> None:
    """However the limits are configured, a setpoint counts its metres from the EKF origin up to a bound."""
    farthest_m = max(abs(metres) for point in points for metres in (*point, up_m or 0.0))
    if not farthest_m <= MOST_METRES:
        raise SetpointRefusedError(
            f"{farthest_m / 1000.0:.0f} km from the EKF origin is more than a setpoint can say",
            refusal="limit.distance",
        )


def _refuse_beyond_fence(points: tuple[Ground, ...], where: VehiclePose) -> None:
    if where.fence is None:
        return
    north, east, _ = where.home_ned or (0.0, 0.0, 0.0)
    places = [where.in_fence(point[0] - north, point[1] - east) for point in points]
    shape = shapes.Point(places[0]) if len(places) == 1 else shapes.LineString(places)
    if not where.fence.allows(shape):
        raise SetpointRefusedError("it leads out of the fence on board", refusal="limit.fence")
