"""The ground paths of a plan, which are checked against the fence."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from app.domain.airspace import shapes
from app.domain.autopilot import Quantity, behaviour, quantity
from app.domain.geo import LatLon, LocalProjection
from app.domain.items import Land
from app.domain.items.landing_pattern import landing_pattern
from app.domain.plan.document import Plan
from app.domain.plan.walk import Step
from app.domain.prediction.motion import flight_of
from app.domain.prediction.path_return import positions_of, return_ends
from app.domain.vehicle.state import FlightRegime, GlobalPosition, VehicleProfile, VehicleType

_SEGMENTS: Final = 32
"""Of a quarter circle."""


@dataclass(frozen=True, slots=True)
class GroundPath:
    """What one step draws over the ground: a leg, a circle, an approach."""

    step: Step
    shape: shapes.BaseGeometry


def ground_paths(
    plan: Plan, steps: tuple[Step, ...], home: GlobalPosition, facts: VehicleProfile, projection: LocalProjection
) -> Iterator[GroundPath]:
    """All paths of a plan, those of its jumps too, and of its return to wherever it may go."""
    ends = {step.item.id: step.end for step in steps}
    for step in steps:
        item = step.item
        if isinstance(item, Land) and facts.vehicle_type is VehicleType.FIXED_WING:
            yield GroundPath(step, _approach_shape(item, step, home, facts, projection))
        elif (target := item.jumps_to()) is not None:
            if target in ends:
                yield GroundPath(step, _line(step.start, ends[target], projection))
        elif item.goes_home:
            yield from _return_paths(plan, step, facts, projection)
        else:
            yield GroundPath(step, _line(step.start, step.end, projection))
        if item.circles() and step.after in (FlightRegime.FIXED_WING, FlightRegime.BUOYANCY):
            radius_m = abs(item.circle_radius_m() or quantity(facts, Quantity.LOITER_RADIUS_M))
            yield GroundPath(step, point_of(step.end, projection).buffer(radius_m, quad_segs=_SEGMENTS))
        elif item.takes_off:
            yield GroundPath(step, point_of(step.start, projection))


def _return_paths(plan: Plan, step: Step, facts: VehicleProfile, projection: LocalProjection) -> Iterator[GroundPath]:
    flight, here = flight_of(plan, behaviour(facts).usable()), point_of(step.start, projection)
    for end in return_ends(flight, (here.x, here.y), positions_of(flight, plan), step.index):
        there = shapes.Point(end)
        yield GroundPath(step, here if here.distance(there) == 0 else shapes.LineString([here, there]))


def point_of(place: LatLon, projection: LocalProjection) -> shapes.Point:
    return shapes.Point(projection.to_local(place.latitude_deg, place.longitude_deg))


def _approach_shape(
    item: Land, step: Step, home: GlobalPosition, facts: VehicleProfile, projection: LocalProjection
) -> shapes.BaseGeometry:
    """The way to the circle, the circle, and both possible tangents to the touchdown."""
    pattern = landing_pattern(item, item.approach, step.start, home, facts)
    circle = point_of(pattern.circle, projection).buffer(abs(pattern.radius_m), quad_segs=_SEGMENTS)
    tangents = shapes.union_all([circle, point_of(pattern.touchdown, projection)]).convex_hull
    return shapes.union_all([tangents, _line(step.start, pattern.circle, projection)])


def _line(start: LatLon, end: LatLon, projection: LocalProjection) -> shapes.BaseGeometry:
    first, last = point_of(start, projection), point_of(end, projection)
    return first if first.distance(last) == 0 else shapes.LineString([first, last])
