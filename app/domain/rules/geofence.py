"""Rules for the geofence of the plan and of the vehicle. PX4 checks waypoints; these rules also check the legs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from app.domain.airspace import shapes
from app.domain.airspace.fence_route import NoWay, Way, length_m
from app.domain.airspace.geofence import (
    MIN_AREA_M2,
    FenceArea,
    crosses_antimeridian,
    is_simple_polygon,
    polygon_shape,
)
from app.domain.autopilot import Quantity
from app.domain.geo import LatLon
from app.domain.prediction.ground_paths import GroundPath, ground_paths, point_of
from app.domain.prediction.motion import course
from app.domain.prediction.return_to_launch import follows_mission
from app.domain.rules.places import from_home_m, planned_places
from app.domain.rules.registry import RuleContext, RuleSet, Violation, at_item
from app.domain.validation.finding import json_pointer
from app.domain.vehicle.state import HOME, FlightRegime

rules = RuleSet()

FLAT_WITHIN_M: Final = 100_000.0


@rules.error(
    "geofence.self_crossing",
    "The inside of a polygon that intersects itself or has hardly an area is ambiguous.",
    "Waydrop; PX4 accepts it and counts crossings.",
)
def _simple_polygons(context: RuleContext) -> Iterator[Violation]:
    for index, polygon in enumerate(context.plan.geofence.polygons):
        shape = polygon_shape(polygon, context.projection)
        if not is_simple_polygon(shape):
            message = "the polygon intersects itself or has no area"
            hint = "list the corners in order around the polygon"
            if shape.is_valid:
                message = f"the polygon has an area of {shape.area:.2f} m²; the smallest is {MIN_AREA_M2:g} m²"
                hint = "make it larger, or use a circle"
            around_home = _is_beyond_flat_earth(shape) or abs(shape.area - MIN_AREA_M2) < 0.01 * MIN_AREA_M2
            assumed = (HOME,) if around_home and not context.knows_home else ()
            yield Violation(json_pointer("geofence", "polygons", index, "vertices"), message, hint, assumed=assumed)


@rules.error(
    "geofence.antimeridian",
    "PX4 compares longitudes as numbers, so that a polygon across the antimeridian has its inside outside.",
    "PX4 Geofence::insidePolygon.",
)
def _on_one_side(context: RuleContext) -> Iterator[Violation]:
    for index, polygon in enumerate(context.plan.geofence.polygons):
        if crosses_antimeridian(polygon):
            message = "the polygon has an edge across the antimeridian, or contains a pole"
            hint = "use one polygon on each side of 180 degrees of longitude, or circles"
            yield Violation(json_pointer("geofence", "polygons", index, "vertices"), message, hint)


@rules.error(
    "geofence.home_outside",
    "A geofence that does not contain home is invalid: the vehicle would violate it before takeoff.",
    "PX4: Geofence invalid, doesn't contain Home position (flown).",
)
def _home_inside(context: RuleContext) -> Iterator[Violation]:
    home = LatLon(context.home.latitude_deg, context.home.longitude_deg, 0.0)
    if context.fence is not None and not _allows(context, context.fence, home):
        message = f"home lies outside the geofence, which {context.autopilot.name} rejects as invalid"
        yield Violation("/geofence", message, "move the geofence, or start elsewhere")


@rules.error(
    "geofence.leg_outside",
    "PX4 checks waypoints against the geofence, but not the legs between them. In flight it stops at the geofence.",
    "PX4 FeasibilityChecker and issues 22362, 22394; Waydrop for the legs.",
)
def _legs_inside(context: RuleContext) -> Iterator[Violation]:
    area = context.fence
    if area is None:
        return
    broken: set[int] = set()
    placed = (step.index for step in context.steps if step.item.point() is not None)
    first = next(placed, len(context.steps))  # up to there the vehicle is at home, or on its way from there
    for path in _paths(context):
        step = path.step
        if step.index in broken or area.allows(path.shape):
            continue
        if isinstance(way := _way_round(context, path), tuple):
            continue
        broken.add(step.index)
        allows_end = _allows(context, area, step.end)
        inside = allows_end and not step.item.circles()
        message = "the leg to this item leaves the geofence" if inside else "this item violates the geofence"
        if step.item.goes_home:
            setting = context.behaviour.returns.setting
            message = f"the return leaves the geofence (its destination depends on {setting} and the rally points)"
        if way is NoWay.UNKNOWN:
            message = "the direct return leaves the geofence, which is too intricate to find the way around it"
        if step.item.jumps_to() is not None:
            message = "the leg back to the jump target leaves the geofence"
        hint = "stay inside the inclusions and outside the exclusions: add a waypoint, or change the geofence"
        from_home = step.index <= first and (allows_end or step.item.point() is None)
        from_home = from_home or _is_beyond_flat_earth(path.shape)
        yield replace(at_item(step, message, hint), assumed=(HOME,) if from_home and not context.knows_home else ())


@rules.warning(
    "geofence.return_round",
    "From v1.19 on, PX4 flies a direct return around the geofence, unless built without that feature.",
    "PX4 PR 27145, RTLPlanner; CONFIG_NAVIGATOR_GEOFENCE_AVOIDANCE.",
)
def _returns_round(context: RuleContext) -> Iterator[Violation]:
    area = context.fence
    if area is None:
        return
    reported: set[int] = set()
    for path in _paths(context):
        if path.step.index in reported or area.allows(path.shape):
            continue
        if isinstance(way := _way_round(context, path), tuple):
            reported.add(path.step.index)
            message = (
                f"the direct return leaves the geofence: the vehicle flies {length_m(way):.0f} m around it "
                f"instead of {path.shape.length:.0f} m"
            )
            hint = "firmware without geofence avoidance flies straight: keep the direct return inside the geofence"
            yield at_item(path.step, message, hint)


def _way_round(context: RuleContext, path: GroundPath) -> Way | NoWay:
    """Return the path of a direct return that the firmware flies around the geofence."""
    ends = list(path.shape.coords) if isinstance(path.shape, shapes.LineString) else []
    if not path.step.item.goes_home or not ends or follows_mission(context.facts):
        return NoWay.BLOCKED
    if not context.behaviour.returns_round_fence or (routes := context.fence_routes()) is None:
        return NoWay.BLOCKED
    (here_east_m, here_north_m), (east_m, north_m) = ends[0], ends[-1]
    return routes.way((here_east_m, here_north_m), (east_m, north_m))


def _is_beyond_flat_earth(shape: shapes.BaseGeometry) -> bool:
    """Beyond this distance from home, straight lines in the local frame depend on where home is."""
    return max(map(abs, shape.bounds)) > FLAT_WITHIN_M


@rules.error("geofence.rally_outside", "A return to a rally point outside the geofence violates it.", "Waydrop.")
def _rally_inside(context: RuleContext) -> Iterator[Violation]:
    area = context.fence
    if area is None:
        return
    for index, point in enumerate(context.plan.rally_points):
        if not _allows(context, area, LatLon(point.latitude_deg, point.longitude_deg, 0.0)):
            message = "the rally point lies outside the geofence"
            yield Violation(json_pointer("rally_points", index), message, "move it, or change the geofence")


@rules.warning(
    "geofence.little_room",
    "In a turn, a fixed wing deviates from its leg by about the switch distance.",
    "PX4 NPFG switch distance (flown).",
)
def _clearance_for_turns(context: RuleContext) -> Iterator[Violation]:
    area = context.fence
    if area is None:
        return
    for path in _paths(context):
        step = path.step
        if step.after is not FlightRegime.FIXED_WING or not step.item.holds() or not area.allows(path.shape):
            continue
        wanted_m = context.behaviour.switch_distance_m(_over_ground_m_s(context, path))
        clearance_m = area.clearance_m(path.shape)
        if clearance_m < wanted_m:
            message = f"the leg passes {clearance_m:.0f} m from the geofence; a turn may need {wanted_m:.0f} m"
            yield at_item(step, message, "keep fixed-wing legs farther from the geofence")


def _over_ground_m_s(context: RuleContext, path: GroundPath) -> float:
    """In the wind, along the leg."""
    ends = list(path.shape.coords) if isinstance(path.shape, shapes.LineString) else []
    course_rad = course((ends[0][0], ends[0][1]), (ends[-1][0], ends[-1][1])) if ends else None
    return context.wind.ground_speed_m_s(context.speeds_m_s[path.step.index], course_rad)


@rules.warning(
    "geofence.not_enforced",
    "The reaction to a geofence violation is a setting of the vehicle. With GF_ACTION 0 or 1 it flies on, "
    "with 4 its motors stop and it falls.",
    "PX4 GF_ACTION.",
)
def _fence_enforced(context: RuleContext) -> Iterator[Violation]:
    breach = context.behaviour.fence_breach
    if context.vehicle is not None and context.fence is not None and breach.ignored:
        message = f"at this geofence the vehicle {breach.ignored} ({breach.setting})"
        yield Violation("/geofence", message, breach.setting.remedy)


@rules.error("geofence.vehicle_distance", "The vehicle has a geofence of its own around home.", "PX4 GF_MAX_HOR_DIST.")
def _vehicle_distance(context: RuleContext) -> Iterator[Violation]:
    most_m, name = context.behaviour.quantity(Quantity.FARTHEST_M), context.behaviour.name_of(Quantity.FARTHEST_M)
    for planned in planned_places(context) if most_m > 0 else ():
        if most_m < (away_m := from_home_m(context, planned.place)):
            message = f"{away_m:.0f} m from home; the limit of the vehicle is {most_m:g} m ({name})"
            yield at_item(planned.step, message, "stay closer, or change the parameter")


@rules.error("geofence.vehicle_height", "The vehicle has a maximum altitude above home.", "PX4 GF_MAX_VER_DIST.")
def _vehicle_height(context: RuleContext) -> Iterator[Violation]:
    most_m, name = context.behaviour.quantity(Quantity.HIGHEST_M), context.behaviour.name_of(Quantity.HIGHEST_M)
    for planned in planned_places(context) if most_m > 0 else ():
        height_m = planned.height_m
        if height_m is not None and most_m < height_m:
            message = f"{height_m:g} m above home; the limit of the vehicle is {most_m:g} m ({name})"
            yield at_item(planned.step, message, "fly lower, or change the parameter")


def _paths(context: RuleContext) -> Iterator[GroundPath]:
    return ground_paths(context.plan, context.steps, context.origin, context.facts, context.projection)


def _allows(context: RuleContext, area: FenceArea, place: LatLon) -> bool:
    return area.allows(point_of(place, context.projection))
