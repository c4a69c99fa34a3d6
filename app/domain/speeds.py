"""How fast a vehicle flies along its plan: its own cruise speeds, and the plan's changes to them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final

from app.domain.autopilot import Quantity, quantity
from app.domain.carried import Carried, carried_in_flight
from app.domain.default_facts import default_facts
from app.domain.plan.document import Plan
from app.domain.plan.walk import Step
from app.domain.vehicle import VehicleFacts

SLOWEST_M_S: Final = 0.1
FASTEST_M_S: Final = 1000.0
"""What a parameter says is believed between the two."""


def cruise_speed_m_s(facts: VehicleFacts, carried: Carried) -> float:
    """The speed that the vehicle flies when nobody asks for another. 0 on the ground."""
    match carried:
        case Carried.FIXED_WING:
            return _speed_m_s(facts, Quantity.WING_CRUISE_M_S)
        case Carried.WHEELS:
            return _speed_m_s(facts, Quantity.WHEELS_FASTEST_M_S)
        case Carried.ROTARY_WING | Carried.BUOYANCY:
            return _speed_m_s(facts, Quantity.HOVER_CRUISE_M_S)
        case Carried.GROUND:
            return 0.0


def _speed_m_s(facts: VehicleFacts, which: Quantity) -> float:
    """A speed of 0 or less is none that is flown (-1 may mean "no limit"): the type's default then."""
    speed_m_s = quantity(facts, which)
    if not 0.0 < speed_m_s < math.inf:
        speed_m_s = quantity(default_facts(facts.vehicle_type), which)
    return min(max(speed_m_s, SLOWEST_M_S), FASTEST_M_S)


def speed_range_m_s(facts: VehicleFacts, carried: Carried) -> tuple[float, float]:
    """The slowest and fastest speed that the vehicle can be asked for."""
    match carried:
        case Carried.FIXED_WING:
            return _speed_m_s(facts, Quantity.WING_SLOWEST_M_S), _speed_m_s(facts, Quantity.WING_FASTEST_M_S)
        case Carried.WHEELS:
            return 0.0, _speed_m_s(facts, Quantity.WHEELS_FASTEST_M_S)
        case Carried.ROTARY_WING | Carried.BUOYANCY | Carried.GROUND:
            return 0.0, _speed_m_s(facts, Quantity.HOVER_FASTEST_M_S)


def speeds_along(plan: Plan, facts: VehicleFacts, steps: Iterable[Step]) -> tuple[float, ...]:
    """Ground speed in m/s without wind at the end of each step; a vehicle takes no more than its range.

    A transition ends an asked-for speed: PX4 flies its own again, on the wing and in hover.
    """
    asked = _asked_at_start(plan)
    speeds: list[float] = []
    if facts.in_flight is not None and facts.in_flight.asked_speed_m_s is not None:
        asked[carried_in_flight(plan.vehicle_type, facts.in_flight)] = facts.in_flight.asked_speed_m_s
    for step in steps:
        _ask(asked, plan, step)
        slowest, fastest = speed_range_m_s(facts, step.after)
        wanted = asked.get(step.after, cruise_speed_m_s(facts, step.after))
        speeds.append(min(max(wanted, slowest), fastest))
    return tuple(speeds)


def asked_speed_m_s(plan: Plan, steps: Iterable[Step], carried: Carried) -> float | None:
    """The speed that a plan asked for last, for what carries the vehicle now; None if it asked for none."""
    asked = _asked_at_start(plan)
    for step in steps:
        _ask(asked, plan, step)
    return asked.get(carried)


def _asked_at_start(plan: Plan) -> dict[Carried, float]:
    return {} if plan.cruise_speed_m_s is None else {Carried.WHEELS: plan.cruise_speed_m_s}


def _ask(asked: dict[Carried, float], plan: Plan, step: Step) -> None:
    item = step.item
    if item.transition_to() is not None:
        asked.clear()
    speed_m_s = plan.cruise_speed_m_s if item.takes_off else item.asked_speed_m_s()
    if speed_m_s is not None:
        asked[step.after] = speed_m_s
