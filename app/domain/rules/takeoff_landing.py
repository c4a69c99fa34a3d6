"""Rules for the start and the end of a flight."""

from __future__ import annotations

from collections.abc import Iterator

from app.domain.autopilot.base import MissionNeeds
from app.domain.items import PlanItem
from app.domain.items.fields import Altitude
from app.domain.rules.registry import RuleContext, RuleSet, Violation, at_item
from app.domain.vehicle.state import VehicleType

rules = RuleSet()
_FEASIBILITY = "PX4 FeasibilityChecker"


@rules.error(
    "takeoff.missing",
    "Every flying vehicle starts on the ground. Some firmware climbs by itself, some rejects the mission.",
    f"{_FEASIBILITY} (MIS_TKO_LAND_REQ 1, 3, 4); Waydrop otherwise.",
)
def _takeoff_there(context: RuleContext) -> Iterator[Violation]:
    if _is_rover(context) or any(item.takes_off for item in context.plan.items):
        return
    if context.facts.in_flight is not None:
        return
    message = "the plan has no takeoff, so what the vehicle does on the ground depends on its firmware"
    yield at_item(context.steps[0], message, "start the plan with a takeoff item")


@rules.error(
    "takeoff.not_first",
    "A takeoff after any other item, or a second takeoff, makes the mission infeasible.",
    f"{_FEASIBILITY}: takeoff is not the first waypoint item (flown).",
)
def _takeoff_first(context: RuleContext) -> Iterator[Violation]:
    before: list[PlanItem] = []
    for step in context.steps:
        if step.item.takes_off:
            others = [item for item in before if not item.is_preparation]
            if others and not _is_rover(context):
                message = f"the takeoff comes after {others[0].id}, which makes the mission infeasible"
                hint = "move it to the start; after a landing within the plan, the next waypoint takes off by itself"
                yield at_item(step, message, hint)
        before.append(step.item)


@rules.error("rover.no_takeoff_or_landing", "A rover neither takes off nor lands.", "PX4 rover land detector (flown).")
def _rover_stays_down(context: RuleContext) -> Iterator[Violation]:
    if not _is_rover(context):
        return
    for step in context.steps:
        if step.item.takes_off:
            yield at_item(step, "a rover does not take off", "remove the takeoff item")
        elif _is_landing(step.item):
            message = "a rover never reports landed in Mission mode, so a land item never ends"
            yield at_item(step, message, "end the plan with a waypoint or return_to_launch")


@rules.error(
    "airship.no_landing",
    "An airship ends its plan at its mast, in the air, because it does not land by itself.",
    "PX4 airship land detector: landed only when disarmed.",
)
def _airship_stays_afloat(context: RuleContext) -> Iterator[Violation]:
    if not _is_airship(context):
        return
    for step in context.steps:
        if _is_landing(step.item):
            message = "an airship reports landed only when disarmed, so a land item never ends"
            yield at_item(
                step, message, "end the plan with a waypoint at the mast, where the crew takes over and disarms"
            )


@rules.error(
    "takeoff.too_low",
    "A takeoff must end above home; before v1.16, or with unknown firmware, 1 m above the acceptance radius.",
    f"{_FEASIBILITY}: takeoff altitude too low.",
)
def _takeoff_above_home(context: RuleContext) -> Iterator[Violation]:
    for step in context.steps:
        altitude = step.item.altitude()
        if not step.item.takes_off or altitude is None or not context.knows_height(altitude):
            continue
        altitude_m = step.end.relative_altitude_m
        lowest_m = 0.0 if altitude_m <= 0 else context.behaviour.lowest_takeoff_m
        if altitude_m <= 0 or altitude_m < lowest_m:
            message = f"a takeoff to {altitude_m:g} m above home is too low"
            hint = f"take off to at least {lowest_m:g} m" if lowest_m else "set an altitude above home"
            yield at_item(step, message, hint, *_altitude_field(altitude))


@rules.error(
    "takeoff.fixed_wing_position",
    "The position of a fixed wing's takeoff item determines the direction of its climb.",
    "PX4 fixed-wing takeoff; flown with a position 160 m ahead.",
)
def _fixed_wing_takeoff_direction(context: RuleContext) -> Iterator[Violation]:
    if context.plan.vehicle_type is not VehicleType.FIXED_WING:
        return
    for step in context.steps:
        if step.item.takes_off and step.item.point() is None:
            message = "a fixed wing climbs out towards the position of its takeoff item, which has none"
            yield at_item(step, message, "set a position about 100 m ahead of the runway")


@rules.error(
    "landing.required",
    "Without a required landing, the vehicle accepts the upload but never starts. Planes and VTOLs require one.",
    f"{_FEASIBILITY}: MIS_TKO_LAND_REQ (flown: a plan that ends in a return never starts).",
)
def _landing_required(context: RuleContext) -> Iterator[Violation]:
    needs = context.behaviour.mission_needs
    takeoff = any(item.takes_off for item in context.plan.items)
    landing = any(map(_is_landing, context.plan.items))
    last = context.steps[-1]
    if _is_rover(context) and (needs.takeoff or needs.landing):
        message = f"the vehicle requires a takeoff or a landing ({needs.setting}), which a rover never has"
        yield at_item(last, message, needs.setting.remedy)
    elif context.facts.in_flight is not None:
        yield from _required_in_flight(context, needs, landing=landing)
    elif needs.landing and not landing:
        message = f"the vehicle requires a landing in every mission ({needs.setting}); a return is not a landing"
        yield at_item(last, message, "end the plan with a land item")
    elif needs.both_or_neither and takeoff != landing:
        message = f"the vehicle requires both takeoff and landing, or neither ({needs.setting})"
        yield at_item(last, message, "end the plan with a land item")


def _required_in_flight(context: RuleContext, needs: MissionNeeds, *, landing: bool) -> Iterator[Violation]:
    """The remaining items of a plan have no takeoff. The vehicle checks them all the same, and drops its mission."""
    if needs.takeoff or (needs.both_or_neither and not needs.landing_in_flight and landing):
        message = f"the vehicle requires a takeoff in every mission ({needs.setting}), also in flight"
        yield at_item(context.steps[0], message, f"{needs.without_takeoff} before the next flight")
    elif needs.landing_in_flight and not landing:
        message = f"the vehicle requires a landing in every mission ({needs.setting}); a return is not a landing"
        yield at_item(context.steps[-1], message, "end the plan with a land item")


@rules.error(
    "landing.flight_does_not_end",
    "After the last item, a multicopter hovers and a fixed wing circles.",
    "PX4 navigator: Mission finished, loitering (flown).",
)
def _flight_ends(context: RuleContext) -> Iterator[Violation]:
    last = context.steps[-1]
    if last.item.lands or last.item.never_ends():
        return
    if _is_rover(context) or _is_airship(context):
        return
    message = "after the last item the vehicle stays in the air until its battery is empty"
    if any(item.lands for item in context.plan.items):
        message = "the last item is not a landing, so the vehicle stays armed"
    yield at_item(last, message, "end the plan with a land or return_to_launch item")


@rules.warning(
    "landing.ends_in_loiter", "An unlimited loiter at the end waits for an operator.", "PX4 NAV_LOITER_UNLIM."
)
def _ends_in_loiter(context: RuleContext) -> Iterator[Violation]:
    last = context.steps[-1]
    if last.item.never_ends():
        yield at_item(last, "the plan ends with an unlimited loiter", "an operator must take over there")


@rules.error(
    "landing.first",
    "On the ground, a mission must not start with a landing. A VTOL rejects it in flight too, and loiters.",
    f"{_FEASIBILITY}: starts with landing, starts with land waypoint (flown).",
)
def _starts_with_landing(context: RuleContext) -> Iterator[Violation]:
    if context.facts.in_flight is not None:
        yield from _rest_starts_with_landing(context)
        return
    for step in context.steps:
        if step.item.flies:
            return
        if _is_landing(step.item):
            yield at_item(step, "the plan lands before it has flown anywhere", "take off first")
            return


def _rest_starts_with_landing(context: RuleContext) -> Iterator[Violation]:
    """A vehicle in flight. A fixed wing has its approach before the landing; the speed of the flight, if the plan asked
    for one, comes first.
    """
    now, first = context.facts.in_flight, context.steps[0]
    is_vtol = context.plan.vehicle_type is VehicleType.VTOL
    if is_vtol and now is not None and now.asked_speed_m_s is None and _is_landing(first.item):
        message = "a VTOL rejects a mission that starts with a landing, also in flight, and would loiter"
        yield at_item(first, message, "continue at an item before the landing, or command return or land")


@rules.error(
    "landing.twice",
    "After a landing, only a position item takes off again. A return or another landing ends the flight.",
    "PX4 navigator (flown).",
)
def _return_from_ground(context: RuleContext) -> Iterator[Violation]:
    landed = False
    for step in context.steps:
        if landed and step.item.lands:
            message = "the vehicle is on the ground here, so its flight would end where it landed"
            yield at_item(step, message, "insert a waypoint before it, which takes off again")
        if _is_landing(step.item):
            landed = True
        elif step.item.flies:
            landed = False


def _is_rover(context: RuleContext) -> bool:
    return context.plan.vehicle_type is VehicleType.ROVER


def _is_airship(context: RuleContext) -> bool:
    return context.plan.vehicle_type is VehicleType.AIRSHIP


def _is_landing(item: PlanItem) -> bool:
    """A landing item of the plan, as opposed to the landing of a return."""
    return item.is_stop and item.lands


def _altitude_field(item: Altitude) -> tuple[str]:
    return ("relative_altitude_m" if item.relative_altitude_m is not None else "absolute_altitude_m",)
