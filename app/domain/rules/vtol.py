"""Rules for vehicles that change between hovering and wing-borne flight."""

from __future__ import annotations

from collections.abc import Iterator

from app.domain.carried import Carried
from app.domain.finding import Severity
from app.domain.rules.registry import Rule, RuleContext, Violation, at_item
from app.domain.vehicle import VehicleType

_STATE = {"fixed_wing": Carried.FIXED_WING, "multicopter": Carried.ROTARY_WING}


def _only_vtol(context: RuleContext) -> Iterator[Violation]:
    if context.plan.vehicle_type is VehicleType.VTOL:
        return
    for step in context.steps:
        if step.item.transition_to() is not None:
            message = f"a {context.plan.vehicle_type} has no transition"
            yield at_item(step, message, "take the item away, or plan for a vtol")


def _in_the_air(context: RuleContext) -> Iterator[Violation]:
    if context.plan.vehicle_type is not VehicleType.VTOL:
        return
    for step in context.steps:
        if step.item.transition_to() is not None and step.before is Carried.GROUND:
            message = "a transition on the ground"
            yield at_item(step, message, "put it after the takeoff, or after the waypoint that takes off again")


def _changes_something(context: RuleContext) -> Iterator[Violation]:
    if context.plan.vehicle_type is not VehicleType.VTOL:
        return
    for step in context.steps:
        to = step.item.transition_to()
        if to is not None and step.before is _STATE[to]:
            message = f"the vehicle is in {to} flight already"
            yield at_item(step, message, "take the item away: a VTOL takeoff ends with a transition of its own", "to")


RULES = (
    Rule(
        "vtol.items_only_on_vtol",
        Severity.ERROR,
        "VTOL items make the mission of any other vehicle infeasible.",
        "PX4 FeasibilityChecker: VTOL items only on VTOL.",
        _only_vtol,
    ),
    Rule(
        "vtol.transition_on_ground",
        Severity.ERROR,
        "A transition needs flight.",
        "PX4 commander: transition denied when landed.",
        _in_the_air,
    ),
    Rule(
        "vtol.transition_without_effect",
        Severity.WARNING,
        "A transition to the state in which the vehicle is already does nothing; probably another one is missing.",
        "PX4 NAV_VTOL_TAKEOFF transitions by itself (flown).",
        _changes_something,
    ),
)
