"""Walks along a plan: where the vehicle is at each item, and in which flight regime.

Rules, compiler and prediction all use this walk, so they cannot disagree.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from app.domain.autopilot import Quantity, behaviour, quantity
from app.domain.autopilot.declared import default_facts
from app.domain.geo import LatLon
from app.domain.items import PlanItem
from app.domain.plan.document import Plan
from app.domain.vehicle.state import (
    HOME,
    FlightRegime,
    GlobalPosition,
    InFlight,
    VehicleProfile,
    VehicleType,
    carried_in_flight,
)


@dataclass(frozen=True, slots=True)
class Step:
    """A step of the walk. `start` and `end` are the positions where the item begins and ends.

    `anchor` is the index of the position item where the vehicle still is (its own index for a position item): only
    delays, speed changes and drops are in between. None after takeoff, transition, return or jump, and before any
    position.
    """

    index: int
    item: PlanItem
    before: FlightRegime
    after: FlightRegime
    start: LatLon
    end: LatLon
    anchor: int | None


def walk(
    plan: Plan, home: GlobalPosition, order: Iterable[int] | None = None, in_flight: InFlight | None = None
) -> tuple[Step, ...]:
    """Return the steps of a plan, in its own order or in another (jumps unrolled). Jumps do not move the vehicle.

    The walk starts on the ground at home, or where the vehicle flies.
    """
    steps: list[Step] = []
    carried = FlightRegime.WHEELS if plan.vehicle_type is VehicleType.ROVER else FlightRegime.GROUND
    place = LatLon(home.latitude_deg, home.longitude_deg, 0.0)
    if in_flight is not None:
        carried = carried_in_flight(plan.vehicle_type, in_flight)
        place = LatLon(in_flight.latitude_deg, in_flight.longitude_deg, in_flight.relative_altitude_m)
    anchor: int | None = None
    for index in range(len(plan.items)) if order is None else order:
        item = plan.items[index]
        after = item.carried_after(plan.vehicle_type, carried)
        end = item.end_of(home, place)
        anchor = _anchor(item, index, anchor)
        steps.append(Step(index, item, carried, after, place, end, anchor))
        carried, place = after, end
    return tuple(steps)


def reference_home(plan: Plan, facts: VehicleProfile | None) -> GlobalPosition:
    """Return the home of the vehicle, else of the plan, else the ground below the first position of the plan."""
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


SLOWEST_M_S: Final = 0.1
FASTEST_M_S: Final = 1000.0
"""Plausible range of a speed parameter."""


OWN_SPEED: Final[Mapping[FlightRegime, Quantity]] = {
    FlightRegime.FIXED_WING: Quantity.WING_CRUISE_M_S,
    FlightRegime.WHEELS: Quantity.WHEELS_FASTEST_M_S,
    FlightRegime.ROTARY_WING: Quantity.HOVER_CRUISE_M_S,
    FlightRegime.BUOYANCY: Quantity.HOVER_CRUISE_M_S,
}
"""The speed of a vehicle that was asked for none."""


def cruise_speed_m_s(facts: VehicleProfile, carried: FlightRegime) -> float:
    """Return the default speed of the vehicle in a flight regime, 0 on the ground."""
    return _speed_m_s(facts, OWN_SPEED[carried]) if carried in OWN_SPEED else 0.0


def _speed_m_s(facts: VehicleProfile, which: Quantity) -> float:
    """A speed of 0 or less is not a speed (-1 may mean "no limit"), so the default of the type applies."""
    speed_m_s = quantity(facts, which)
    if not 0.0 < speed_m_s < math.inf:
        speed_m_s = quantity(default_facts(facts.vehicle_type), which)
    return min(max(speed_m_s, SLOWEST_M_S), FASTEST_M_S)


def speed_range_m_s(facts: VehicleProfile, carried: FlightRegime) -> tuple[float, float]:
    """Return the slowest and fastest speed that can be requested."""
    match carried:
        case FlightRegime.FIXED_WING:
            return _speed_m_s(facts, Quantity.WING_SLOWEST_M_S), _speed_m_s(facts, Quantity.WING_FASTEST_M_S)
        case FlightRegime.WHEELS:
            return 0.0, _speed_m_s(facts, Quantity.WHEELS_FASTEST_M_S)
        case FlightRegime.BUOYANCY:  # PX4 has no position controller for airships that a parameter could limit
            usual_m_s = quantity(default_facts(facts.vehicle_type), Quantity.HOVER_FASTEST_M_S)
            return 0.0, max(usual_m_s, cruise_speed_m_s(facts, carried))
        case FlightRegime.ROTARY_WING | FlightRegime.GROUND:
            return 0.0, _speed_m_s(facts, Quantity.HOVER_FASTEST_M_S)


def speeds_along(plan: Plan, facts: VehicleProfile, steps: Iterable[Step]) -> tuple[float, ...]:
    """Return the ground speed in m/s in calm air at the end of each step (of a return: on its way), within the range of
    the vehicle.

    A transition ends a requested speed: PX4 returns to its default, in fixed-wing flight and in hover. A speed that is
    requested on the ground is that of the flight after it.
    """
    asked = _asked_at_start(plan)
    speeds: list[float] = []
    if facts.in_flight is not None and facts.in_flight.asked_speed_m_s is not None:
        asked[carried_in_flight(plan.vehicle_type, facts.in_flight)] = facts.in_flight.asked_speed_m_s
    ranges: dict[FlightRegime, tuple[float, float, float]] = {}
    for step in steps:
        if step.item.goes_home:
            grounded = step.before is FlightRegime.GROUND
            flies = carried_in_flight(plan.vehicle_type) if grounded else step.before
            speeds.append(return_speed_m_s(facts, flies, asked.get(flies)))
            asked.clear()
            continue
        _ask(asked, plan, step)
        if step.after not in ranges:
            ranges[step.after] = (*speed_range_m_s(facts, step.after), cruise_speed_m_s(facts, step.after))
        slowest, fastest, own = ranges[step.after]
        speeds.append(min(max(asked.get(step.after, own), slowest), fastest))
    return tuple(speeds)


def return_speed_m_s(facts: VehicleProfile, carried: FlightRegime, asked_m_s: float | None) -> float:
    """Return the speed of a return in this regime. `asked_m_s`: the last requested speed, None if none.

    PX4 enters Return with its default speed. Only along the mission's items it repeats their last change of speed.
    """
    slowest, fastest = speed_range_m_s(facts, carried)
    if asked_m_s is None or not behaviour(facts).returns.along_items:
        asked_m_s = cruise_speed_m_s(facts, carried)
    return min(max(asked_m_s, slowest), fastest)


def asked_speed_m_s(plan: Plan, steps: Iterable[Step], carried: FlightRegime) -> float | None:
    """Return the last speed that the plan requested for the current flight regime, None if none."""
    asked = _asked_at_start(plan)
    for step in steps:
        _ask(asked, plan, step)
    return asked.get(carried)


def _asked_at_start(plan: Plan) -> dict[FlightRegime, float]:
    return {} if plan.cruise_speed_m_s is None else {FlightRegime.WHEELS: plan.cruise_speed_m_s}


def _ask(asked: dict[FlightRegime, float], plan: Plan, step: Step) -> None:
    item = step.item
    if item.transition_to() is not None or item.goes_home or _turns_at_takeoff(plan, step):
        asked.clear()
    speed_m_s = plan.cruise_speed_m_s if item.takes_off else item.asked_speed_m_s()
    if speed_m_s is not None:
        asked[asks_for(plan, step)] = speed_m_s


def asks_for(plan: Plan, step: Step) -> FlightRegime:
    """Return the flight regime for which a step requests its speed: on the ground, that in which it takes off."""
    if step.after is FlightRegime.GROUND:
        return carried_in_flight(plan.vehicle_type)
    return step.after


def _turns_at_takeoff(plan: Plan, step: Step) -> bool:
    """NAV_VTOL_TAKEOFF ends with a transition."""
    return plan.vehicle_type is VehicleType.VTOL and step.item.takes_off
