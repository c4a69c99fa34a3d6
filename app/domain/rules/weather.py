"""Rules for the wind of the check."""

from __future__ import annotations

from collections.abc import Iterator

from app.domain.autopilot import Quantity, quantity
from app.domain.autopilot.declared import default_facts
from app.domain.plan.walk import Step
from app.domain.prediction.rotary import wind_load
from app.domain.rules.registry import RuleContext, RuleSet, Violation, at_item
from app.domain.vehicle.state import FlightRegime, VehicleType

rules = RuleSet()
_THROUGH_AIR = (FlightRegime.FIXED_WING, FlightRegime.BUOYANCY)


@rules.error(
    "wind.too_strong",
    "A fixed wing or airship that is not faster than the wind cannot follow its path. A hovering vehicle has no known "
    "airspeed; none is expected above MPC_XY_VEL_MAX. That limits the ground speed and may be lowered for safety, so a "
    "value below PX4's default counts as the default.",
    "Waydrop; the wind is a parameter of the check.",
)
def _faster_than_wind(context: RuleContext) -> Iterator[Violation]:
    wind_m_s, before_m_s = context.wind.speed_m_s, 0.0
    if wind_m_s == 0.0:
        return
    for step, own_m_s in zip(context.steps, context.speeds_m_s, strict=True):
        airspeed_m_s = own_m_s or before_m_s  # a landing is flown at the speed of the item before it
        before_m_s = airspeed_m_s
        if _is_carried_by_air(step) and airspeed_m_s <= wind_m_s:
            message = f"the airspeed of {airspeed_m_s:g} m/s does not exceed the wind of {wind_m_s:g} m/s"
            yield at_item(step, message, "wait for less wind, or fly faster")
            return
        if _hovers(context, step) and (fastest_m_s := _fastest_m_s(context)) <= wind_m_s:
            name = context.behaviour.name_of(Quantity.HOVER_FASTEST_M_S)
            expected = f"at most {fastest_m_s:g} m/s of airspeed can be expected"
            message = f"{wind_m_s:g} m/s of wind: {expected} (the higher of {name} and its default)"
            yield at_item(step, message, "wait for less wind")
            return


@rules.warning(
    "wind.strong",
    "In wind that is stronger than its cruise speed (MPC_XY_CRUISE), or that adds up to more than its fastest speed "
    "(MPC_XY_VEL_MAX), a hovering vehicle may fly slower than predicted, or never arrive.",
    "Waydrop; a simulated quad flew 3.8 m/s against 6 m/s (like a recorded one), and did not arrive against 10 m/s.",
)
def _slower_than_predicted(context: RuleContext) -> Iterator[Violation]:
    wind_m_s = context.wind.speed_m_s
    if not 0.0 < wind_m_s < _fastest_m_s(context):
        return
    for step, speed_m_s in zip(context.steps, context.speeds_m_s, strict=True):
        hovers_m_s = 0.0 if step.after is FlightRegime.FIXED_WING else speed_m_s
        if _hovers(context, step) and wind_load(context.facts, wind_m_s, hovers_m_s) > 1.0:
            message = f"in {wind_m_s:g} m/s of wind the vehicle may be slower than predicted, or never arrive"
            yield at_item(step, message, "wait for less wind, or fly slower; allow more time and battery")
            return


def _fastest_m_s(context: RuleContext) -> float:
    """The highest airspeed to expect in hover. A limit of the ground speed below the default says nothing about it."""
    default_m_s = quantity(default_facts(context.plan.vehicle_type), Quantity.HOVER_FASTEST_M_S)
    return max(context.behaviour.quantity(Quantity.HOVER_FASTEST_M_S), default_m_s)


def _is_carried_by_air(step: Step) -> bool:
    return step.item.moves and (step.after in _THROUGH_AIR or step.before in _THROUGH_AIR)


def _hovers(context: RuleContext, step: Step) -> bool:
    """Also a VTOL that takes off or lands."""
    by_rotor: tuple[FlightRegime, ...] = (FlightRegime.ROTARY_WING,)
    if context.plan.vehicle_type is VehicleType.VTOL:
        by_rotor = (FlightRegime.ROTARY_WING, FlightRegime.GROUND)
    return step.item.moves and (step.before in by_rotor or step.after in by_rotor)
