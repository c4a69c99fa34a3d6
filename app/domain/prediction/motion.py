"""Where a predicted vehicle is and how it moves: each item begins where and as the one before it ended."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Final, NamedTuple, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from app.domain.airspace.fence_route import FenceRoutes
from app.domain.airspace.geofence import FenceArea, fence_area
from app.domain.autopilot import Quantity, behaviour, quantity
from app.domain.geo import LocalProjection
from app.domain.plan.document import Plan
from app.domain.plan.walk import reference_home
from app.domain.vehicle.state import GlobalPosition, VehicleProfile

_SLOWEST_M_S = 1.0


@dataclass(frozen=True, slots=True)
class Wind:
    """The velocity of the air over ground. Not `given`: no wind was specified, and calm air is assumed."""

    north_m_s: float = 0.0
    east_m_s: float = 0.0
    given: bool = field(default=True, compare=False)

    @property
    def speed_m_s(self) -> float:
        """How strong it is."""
        return math.hypot(self.north_m_s, self.east_m_s)

    def ground_speed_m_s(self, airspeed_m_s: float, course_rad: float | None) -> float:
        """Along a track that is held against the wind; the airspeed where there is no track (a circle)."""
        if course_rad is None:
            return airspeed_m_s
        along = self.north_m_s * math.cos(course_rad) + self.east_m_s * math.sin(course_rad)
        across = self.east_m_s * math.cos(course_rad) - self.north_m_s * math.sin(course_rad)
        forward = math.sqrt(max(0.0, airspeed_m_s**2 - across**2))
        return max(_SLOWEST_M_S, forward + along)


CALM = Wind(given=False)
"""Assumed if no wind is given."""

STRONGEST_M_S: Final = 75.0
_Component = Annotated[float, Field(ge=-STRONGEST_M_S, le=STRONGEST_M_S)]


class WindGiven(BaseModel):
    """A steady wind: `from_deg` (clockwise from north, where it comes from) and `speed_m_s`, as in weather reports,
    or `north_m_s` and `east_m_s`, where the air goes.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    from_deg: Annotated[float, Field(ge=0, le=360)] | None = None
    speed_m_s: Annotated[float, Field(ge=0, le=STRONGEST_M_S)] | None = None
    north_m_s: _Component | None = None
    east_m_s: _Component | None = None

    @model_validator(mode="after")
    def _one_way_to_say_it(self) -> Self:
        polar, parts = (self.from_deg, self.speed_m_s), (self.north_m_s, self.east_m_s)
        whole = [pair for pair in (polar, parts) if None not in pair]
        if len(whole) != 1 or any(pair not in whole and pair != (None, None) for pair in (polar, parts)):
            raise PydanticCustomError("wind", "give from_deg and speed_m_s, or north_m_s and east_m_s")
        return self

    def wind(self) -> Wind:
        """Where the air goes."""
        if self.from_deg is None or self.speed_m_s is None:
            return Wind(self.north_m_s or 0.0, self.east_m_s or 0.0)
        towards = math.radians(self.from_deg + 180.0)
        return Wind(round(self.speed_m_s * math.cos(towards), 6), round(self.speed_m_s * math.sin(towards), 6))


Point = tuple[float, float]
"""East and north of home, in metres."""


class MotionState(NamedTuple):
    """`course_rad` is the course over ground (east of north), `heading_rad` the direction of the nose; None:
    unknown.
    """

    point: Point = (0.0, 0.0)
    up_m: float = 0.0
    speed_m_s: float = 0.0
    course_rad: float | None = None
    heading_rad: float | None = None

    def away_m(self, point: Point) -> float:
        """Horizontal distance to a point."""
        return math.dist(self.point, point)

    def course_to(self, point: Point) -> float:
        """The course to a point; its own at the point."""
        if self.away_m(point) < 0.01:
            return self.course_rad or 0.0
        return course(self.point, point)

    def turn_to(self, point: Point) -> float:
        """How far it has to turn towards a point, 0 to pi; 0 if it does not move."""
        if self.course_rad is None or self.away_m(point) < 0.01:
            return 0.0
        return turn(self.course_rad, self.course_to(point))

    def arrived(self, point: Point, before_m: float, up_m: float, speed_m_s: float) -> MotionState:
        """The motion `before_m` before a point on the straight way to it; not before its start."""
        along = self.course_to(point)
        back_m = min(before_m, self.away_m(point))
        there = ahead(point, along + math.pi, back_m)
        return MotionState(there, up_m, speed_m_s, along if speed_m_s > 0.0 else None, along)

    def standing(self, point: Point | None = None, up_m: float | None = None) -> MotionState:
        """At rest, there or here."""
        at, up = self.point if point is None else point, self.up_m if up_m is None else up_m
        return self._replace(point=at, up_m=up, speed_m_s=0.0, course_rad=None)


def course(start: Point, end: Point) -> float:
    """Course of a line in radians, 0 is north and east is positive."""
    return math.atan2(end[0] - start[0], end[1] - start[1])


def ahead(point: Point, course_rad: float, distance_m: float) -> Point:
    """The point so far along a course."""
    return point[0] + distance_m * math.sin(course_rad), point[1] + distance_m * math.cos(course_rad)


def turn(before_rad: float, after_rad: float) -> float:
    """The angle between two courses, 0 to pi."""
    return abs((after_rad - before_rad + math.pi) % math.tau - math.pi)


class Effort(NamedTuple):
    """Distance and time of one item, and how the vehicle moves at its end. `uncertainty_s`: see TimelineEntry.

    `climbed_m` is the height that it gains on the way, if not simply that from its beginning to its end.
    """

    distance_m: float
    duration_s: float
    end: MotionState
    uncertainty_s: float = 0.0
    climbed_m: float | None = None


class HoverSettings(NamedTuple):
    """Limits of the trajectories of a hovering vehicle; `corner_m_s2` is the acceleration allowed in a corner."""

    acceleration_m_s2: float
    jerk_m_s3: float
    corner_m_s2: float


@dataclass(frozen=True)
class FlightContext:
    """The vehicle, its home, the wind, the rally points and the fence (east and north of home)."""

    facts: VehicleProfile
    home: GlobalPosition
    wind: Wind = CALM
    rally_points: tuple[Point, ...] = field(default=())
    fence: FenceArea | None = None

    @cached_property
    def _projection(self) -> LocalProjection:
        return LocalProjection(self.home.latitude_deg, self.home.longitude_deg)

    @cached_property
    def fence_routes(self) -> FenceRoutes | None:
        """The ways around the fence; None without one."""
        return None if self.fence is None else FenceRoutes(self.fence, behaviour(self.facts).return_margin_m)

    @cached_property
    def hover(self) -> HoverSettings:
        """Read from the vehicle once, and only if it hovers."""
        acceleration_m_s2 = quantity(self.facts, Quantity.HOVER_ACCELERATION_M_S2)
        return HoverSettings(
            max(0.1, acceleration_m_s2),
            max(0.5, quantity(self.facts, Quantity.HOVER_JERK_M_S3)),
            quantity(self.facts, Quantity.CORNER_SHARE) * acceleration_m_s2,
        )

    @cached_property
    def _known(self) -> dict[tuple[float, float], Point]:
        return {}

    def to_local(self, latitude_deg: float, longitude_deg: float) -> Point:
        """East and north of home; worked out once for a place."""
        place = (latitude_deg, longitude_deg)
        if (point := self._known.get(place)) is None:
            point = self._known[place] = self._projection.to_local(latitude_deg, longitude_deg)
        return point

    def to_global(self, point: Point) -> tuple[float, float]:
        """Latitude and longitude in degrees."""
        return self._projection.to_global(*point)


def flight_of(plan: Plan, facts: VehicleProfile, wind: Wind = CALM) -> FlightContext:
    """The context that the predictions of all items share."""
    bare = FlightContext(facts, reference_home(plan, facts), wind)
    rally = tuple(bare.to_local(point.latitude_deg, point.longitude_deg) for point in plan.rally_points)
    return FlightContext(facts, bare.home, wind, rally, _fence_of(plan, bare.home))


def _fence_of(plan: Plan, home: GlobalPosition) -> FenceArea | None:
    """As in newer firmware, which uses it only to plan a return."""
    if not plan.geofence.polygons and not plan.geofence.circles:
        return None
    return fence_area(plan.geofence, LocalProjection(home.latitude_deg, home.longitude_deg), all_of_home=True)
