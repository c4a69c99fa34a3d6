"""Walks along a plan and says, item by item, where the vehicle is and what carries it.

Rules, compiler and prediction all stand on this one walk, so that they cannot disagree.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from app.domain.carried import Carried, carried_in_flight
from app.domain.geo import Place
from app.domain.in_flight import InFlight
from app.domain.items import PlanItem
from app.domain.plan.document import Plan
from app.domain.vehicle import HOME, GlobalPosition, VehicleFacts, VehicleType


@dataclass(frozen=True, slots=True)
class Step:
    """One item of the walk. `start` and `end` are where it begins and ends.

    `anchor` is the index of the position item at which the vehicle still is (itself for a position item): only delays,
    speed changes and drops lie between. None after takeoff, transition, return, jump, or before any position.
    """

    index: int
    item: PlanItem
    before: Carried
    after: Carried
    start: Place
    end: Place
    anchor: int | None


def walk(
    plan: Plan, home: GlobalPosition, order: Iterable[int] | None = None, in_flight: InFlight | None = None
) -> tuple[Step, ...]:
    """The steps of a plan, in its own order or in another (jumps unrolled). Jumps themselves do not move anything.

    It begins on the ground at home, or where the vehicle flies.
    """
    steps: list[Step] = []
    carried = Carried.WHEELS if plan.vehicle_type is VehicleType.ROVER else Carried.GROUND
    place = Place(home.latitude_deg, home.longitude_deg, 0.0)
    if in_flight is not None:
        carried = carried_in_flight(plan.vehicle_type, in_flight)
        place = Place(in_flight.latitude_deg, in_flight.longitude_deg, in_flight.relative_altitude_m)
    anchor: int | None = None
    for index in range(len(plan.items)) if order is None else order:
        item = plan.items[index]
        after = item.carried_after(plan.vehicle_type, carried)
        end = item.end_of(home, place)
        anchor = _anchor(item, index, anchor)
        steps.append(Step(index, item, carried, after, place, end, anchor))
        carried, place = after, end
    return tuple(steps)


def reference_home(plan: Plan, facts: VehicleFacts | None) -> GlobalPosition:
    """The vehicle's home, else the plan's, else below the first position of the plan."""
    if facts is not None and facts.home is not None:
        return facts.home
    if plan.home is not None:
        return GlobalPosition(plan.home.latitude_deg, plan.home.longitude_deg, plan.home.absolute_altitude_m)
    if facts is not None:
        facts.assuming(HOME)
    altitudes = [altitude for item in plan.items if (altitude := item.altitude()) is not None]
    ground_m = min((one.absolute_altitude_m for one in altitudes if one.absolute_altitude_m is not None), default=0)
    for item in plan.items:
        if (point := item.point()) is not None:
            return GlobalPosition(point.latitude_deg, point.longitude_deg, ground_m)
    return GlobalPosition(0.0, 0.0, ground_m)


def _anchor(item: PlanItem, index: int, anchor: int | None) -> int | None:
    if item.is_stop:
        return index
    return anchor if item.stays else None
