"""A return along the mission: on to its landing, or back through its positions and home.

PX4's RtlMissionFast and RtlMissionFastReverse: positions are passed without their hold, drops and jumps are left out,
and nothing climbs to the height of a return first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from app.domain.autopilot import Quantity, Return, behaviour, quantity
from app.domain.geo import LatLon
from app.domain.plan.document import Plan
from app.domain.plan.walk import Step, cruise_speed_m_s
from app.domain.prediction import airship, rotary, rover, vtol, wing
from app.domain.prediction.motion import Effort, FlightContext, MotionState, Point
from app.domain.prediction.return_to_launch import HOME, destinations, follows_mission
from app.domain.vehicle.state import FlightRegime, VehicleProfile, VehicleType


@dataclass(frozen=True, slots=True)
class LegPassage:
    """A position item of the plan, by its index. `radius_m` is its own acceptance radius, None the vehicle's."""

    index: int
    point: Point
    up_m: float
    radius_m: float | None = None
    lands: bool = False


def positions_of(flight: FlightContext, plan: Plan) -> tuple[LegPassage, ...]:
    """The positions of a plan in the order of its items, from its takeoff to its last."""
    place = LatLon(flight.home.latitude_deg, flight.home.longitude_deg, 0.0)
    found: list[LegPassage] = []
    for index, item in enumerate(plan.items):
        place = item.end_of(flight.home, place)
        if item.altitude() is not None:
            point = flight.to_local(place.latitude_deg, place.longitude_deg)
            found.append(LegPassage(index, point, place.relative_altitude_m, item.reach_m(), item.lands))
    return tuple(found)


def landing_of(positions: Sequence[LegPassage]) -> Point | None:
    """The plan's first land item, also one at a customer's."""
    return next((place.point for place in positions if place.lands), None)


def is_unsure_path(facts: VehicleProfile) -> bool:
    """A plane, a rover and an airship end such a return in ways that are not predicted: only the path there is."""
    return follows_mission(facts) and facts.vehicle_type not in (VehicleType.MULTICOPTER, VehicleType.VTOL)


def lands_ahead(returns: Return, positions: Sequence[LegPassage], index: int) -> bool:
    """Whether it flies on to the mission's landing, or back."""
    landing = next((place.index for place in positions if place.lands), None)
    return landing is not None and (not returns.turns_back or landing - index < index)


def fly(
    flight: FlightContext, before: MotionState, step: Step, positions: Sequence[LegPassage], speed_m_s: float
) -> Effort:
    """From the item at which the return begins to the ground; a wing that cannot hover circles where it ends."""
    ahead = lands_ahead(behaviour(flight.facts).returns, positions, step.index)
    passed, end = _way(positions, step.index, ahead=ahead)
    distance_m, seconds, motion = 0.0, 0.0, before
    carried = step.before
    if carried is FlightRegime.ROTARY_WING and flight.facts.vehicle_type is VehicleType.VTOL and not ahead:
        changed = vtol.to_wing(flight, motion, passed[0].point if passed else end.point)
        distance_m, seconds, motion, carried = (
            changed.distance_m,
            changed.duration_s,
            changed.end,
            FlightRegime.FIXED_WING,
        )
        speed_m_s = cruise_speed_m_s(flight.facts, carried)
    for number, place in enumerate(passed):
        following = passed[number + 1] if number + 1 < len(passed) else None
        leg = _leg(flight, motion, carried, place, following, speed_m_s)
        distance_m, seconds, motion = distance_m + leg.distance_m, seconds + leg.duration_s, leg.end
    last = _land(flight, motion, carried, end, speed_m_s)
    return Effort(
        distance_m + last.distance_m, seconds + last.duration_s, last.end, climbed_m=_climbed_m(before, passed)
    )


def _way(positions: Sequence[LegPassage], index: int, *, ahead: bool) -> tuple[Sequence[LegPassage], LegPassage]:
    """The items that are passed, and where it lands."""
    if not ahead:
        return [place for place in reversed(positions) if place.index < index], LegPassage(-1, HOME, 0.0)
    landing = next(place for place in positions if place.lands)
    return [place for place in positions if index < place.index < landing.index], landing


def _leg(
    flight: FlightContext,
    before: MotionState,
    carried: FlightRegime,
    place: LegPassage,
    following: LegPassage | None,
    speed_m_s: float,
) -> Effort:
    match carried:
        case FlightRegime.FIXED_WING:
            return wing.fly(flight, before, place.point, place.up_m, max(speed_m_s, 1.0))
        case FlightRegime.WHEELS:
            return rover.drive(flight, before, place.point, None if following is None else following.point, speed_m_s)
        case FlightRegime.BUOYANCY:
            return airship.fly(flight, before, place.point, place.up_m, speed_m_s)
        case FlightRegime.ROTARY_WING | FlightRegime.GROUND:
            pass
    radius_m = place.radius_m or quantity(flight.facts, Quantity.ACCEPTANCE_RADIUS_M)
    target = rotary.LegTarget(place.point, place.up_m, radius_m)
    if following is not None:
        target = rotary.LegTarget(place.point, place.up_m, radius_m, following.point, following.up_m)
    return rotary.fly(flight, before, target, max(speed_m_s, 0.1))


def _land(
    flight: FlightContext, before: MotionState, carried: FlightRegime, place: LegPassage, speed_m_s: float
) -> Effort:
    """At its current height; a vehicle that cannot land stays above the point."""
    target = rotary.LegTarget(place.point, place.up_m, quantity(flight.facts, Quantity.ACCEPTANCE_RADIUS_M))
    match carried:
        case FlightRegime.WHEELS:
            return rover.drive(flight, before, place.point, None, speed_m_s)
        case FlightRegime.BUOYANCY:
            return airship.fly(flight, before, place.point, before.up_m, speed_m_s)
        case FlightRegime.FIXED_WING if flight.facts.vehicle_type is VehicleType.VTOL:
            hover_m_s = max(0.1, cruise_speed_m_s(flight.facts, FlightRegime.ROTARY_WING))
            return vtol.land(flight, before, target, max(speed_m_s, 1.0), hover_m_s)
        case FlightRegime.FIXED_WING:
            return wing.fly(flight, before, place.point, before.up_m, max(speed_m_s, 1.0))
        case FlightRegime.ROTARY_WING | FlightRegime.GROUND:
            return rotary.land(flight, before, target, max(speed_m_s, 0.1))


def _climbed_m(before: MotionState, passed: Sequence[LegPassage]) -> float:
    heights = [before.up_m, *(place.up_m for place in passed)]
    return sum(max(0.0, after - one) for one, after in pairwise(heights))


def return_ends(flight: FlightContext, here: Point, positions: Sequence[LegPassage], index: int) -> Sequence[Point]:
    """From `here`, at the item with this index; none for a way back along the mission, whose legs are its own."""
    landing = landing_of(positions)
    if not follows_mission(flight.facts):
        return destinations(flight, MotionState(here), lambda: landing)
    ahead = lands_ahead(behaviour(flight.facts).returns, positions, index)
    return (landing,) if ahead and landing is not None else ()
