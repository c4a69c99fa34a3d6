"""Rules for the vehicle that a plan is sent to: type, home, settings."""

from __future__ import annotations

from collections.abc import Iterator

from app.domain.autopilot import Quantity
from app.domain.geo import distance_m
from app.domain.items import Jump, Loiter, PlanItem
from app.domain.items.fields import Altitude
from app.domain.plan.walk import Step
from app.domain.prediction.durations import MAX_VISITS, flown_order
from app.domain.rules.registry import RuleContext, RuleSet, Violation, at_item
from app.domain.vehicle.clock import MAX_LIVE_RATE, TOO_FAST_HINT, is_too_fast, too_fast_words
from app.domain.vehicle.state import HOME, FlightRegime

rules = RuleSet()

MAX_HOME_OFFSET_M = 100.0


@rules.error(
    "vehicle.type_differs",
    "The meaning of braking, takeoff and landing depends on the vehicle type.",
    "HEARTBEAT MAV_TYPE.",
)
def _same_type(context: RuleContext) -> Iterator[Violation]:
    vehicle = context.vehicle
    if vehicle is not None and vehicle.vehicle_type is not context.plan.vehicle_type:
        message = f"the plan is for {context.plan.vehicle_type.noun}, but the vehicle is {vehicle.vehicle_type.noun}"
        yield Violation("/vehicle_type", message, "choose another vehicle, or write the plan for this type")


@rules.error(
    "vehicle.home_unknown",
    "Without home, a mission with relative altitudes is infeasible, and arming is denied.",
    "PX4 FeasibilityChecker: no home position.",
)
def _home_known(context: RuleContext) -> Iterator[Violation]:
    vehicle = context.vehicle
    if vehicle is not None and vehicle.uid is not None and vehicle.home is None:
        yield Violation("", "the vehicle has no home position yet", "wait for a position fix")


@rules.warning(
    "vehicle.home_differs",
    f"A plan whose home is more than {MAX_HOME_OFFSET_M:g} m away may be meant for another vehicle.",
    "Waydrop.",
)
def _home_near(context: RuleContext) -> Iterator[Violation]:
    planned = context.plan.home
    if planned is None or context.vehicle is None or context.vehicle.home is None:
        return
    real = context.vehicle.home
    away_m = distance_m(planned.latitude_deg, planned.longitude_deg, real.latitude_deg, real.longitude_deg)
    if away_m > MAX_HOME_OFFSET_M:
        message = f"the home of the vehicle is {away_m:.0f} m from the home of the plan"
        yield Violation("/home", message, "check that this is the right vehicle; its own home is used")


@rules.error(
    "vehicle.altitudes_not_comparable",
    "The geofence, climb checks and the prediction need all altitudes relative to the same level.",
    "Waydrop.",
)
def _altitudes_comparable(context: RuleContext) -> Iterator[Violation]:
    absolute = [
        step for step in context.steps if isinstance(step.item, Altitude) and not context.knows_height(step.item)
    ]
    if absolute:
        context.facts.assuming(HOME)
        message = "the altitude is absolute and the altitude of home is unknown, so heights above home are not checked"
        yield at_item(absolute[0], message, "set home in the plan, or use relative altitudes")


@rules.warning(
    "contingency.link_loss_differs", "The reaction to a lost link is a setting of the vehicle.", "PX4 NAV_DLL_ACT."
)
def _link_loss(context: RuleContext) -> Iterator[Violation]:
    wanted = context.plan.contingency.on_link_loss
    if wanted is None or context.vehicle is None:
        return
    loss = context.behaviour.link_loss
    if loss.action != wanted:
        message = f"the plan expects {wanted} when the link is lost, but the vehicle has {loss.setting}"
        yield Violation("/contingency/on_link_loss", message, f"set {loss.setting.name}, or change the plan")


@rules.warning(
    "contingency.link_loss_unset",
    "Without a link, a supervised drop is kept: after its hold the vehicle flies on, unless it is set to return.",
    "PX4 NAV_DLL_ACT, default 0.",
)
def _link_loss_set(context: RuleContext) -> Iterator[Violation]:
    if context.vehicle is None or context.plan.contingency.on_link_loss is not None:
        return
    first = next((drop for drop in context.drops if drop.supervised), None)
    if first is not None and (loss := context.behaviour.link_loss).action == "continue":
        message = f"if the link is lost at this supervised drop, the vehicle does nothing ({loss.setting})"
        hint = f'{loss.setting.remedy}, or set "on_link_loss": "continue" to fly on with the parcel'
        yield at_item(first.step, message, hint)


@rules.warning(
    "drop.command_timeout",
    "With MIS_COMMAND_TOUT above 0, the mission waits the full time at each gripper item.",
    "PX4 MIS_COMMAND_TOUT (flown).",
)
def _command_timeout(context: RuleContext) -> Iterator[Violation]:
    wait_s = context.behaviour.quantity(Quantity.COMMAND_WAIT_S)
    name = context.behaviour.name_of(Quantity.COMMAND_WAIT_S)
    for drop in context.drops:
        if wait_s > 0 and not drop.supervised:
            message = f"the mission waits {wait_s:g} s at this drop, even if it is done earlier ({name})"
            yield at_item(drop.step, message, f"set {name} to 0; the compiled mission includes a delay")


@rules.error(
    "vehicle.clock_too_fast",
    f"Our deadlines are wall clock: simulated faster than {MAX_LIVE_RATE:g}x, a vehicle does too much within them.",
    "Waydrop; GLOBAL_POSITION_INT.time_boot_ms against our clock, over 10 s.",
)
def _clock(context: RuleContext) -> Iterator[Violation]:
    rate = None if context.vehicle is None else context.vehicle.least_clock_rate
    if rate is None or not is_too_fast(rate):
        return
    for drop in context.drops:
        if drop.supervised:
            yield at_item(drop.step, too_fast_words(rate), TOO_FAST_HINT)


@rules.error(
    "loiter.turns_unsupported",
    "NAV_LOITER_TURNS (18) is not among the commands that PX4 accepts.",
    "PX4 FeasibilityChecker: unsupported command.",
)
def _loiter_turns(context: RuleContext) -> Iterator[Violation]:
    for step in () if context.autopilot.takes_turns else context.steps:
        if isinstance(step.item, Loiter) and step.item.turns is not None:
            message = f"{context.autopilot.name} does not take a number of turns"
            yield at_item(step, message, 'use "kind": "time" with duration_s', "kind")


@rules.error(
    "commands.never_flown",
    "Items after a return or after an endless loiter are accepted and never flown.",
    "PX4 accepts items after RTL without complaint (flown).",
)
def _never_reached(context: RuleContext) -> Iterator[Violation]:
    for step in context.steps[:-1]:
        following = context.plan.items[step.index + 1]
        if step.item.goes_home:
            yield at_item(step, f"the flight ends with this item; {following.id} is never flown", "move it to the end")
        elif step.item.never_ends():
            message = f"this loiter never ends; {following.id} is never flown"
            yield at_item(step, message, 'use "kind": "time" with duration_s, or move it to the end', "kind")


@rules.warning(
    "delay.does_not_stop",
    "NAV_DELAY waits for time to pass; what cannot hover flies on meanwhile.",
    "PX4 mission_block.cpp.",
)
def _delay_in_the_air(context: RuleContext) -> Iterator[Violation]:
    for step in context.steps:
        if step.item.waits and step.before in (FlightRegime.FIXED_WING, FlightRegime.BUOYANCY):
            message = "the vehicle does not stand during this delay"
            yield at_item(step, message, "use a loiter item of kind time")


@rules.error(
    "jump.target",
    "PX4 accepts a DO_JUMP to an item that does not exist.",
    "PX4 FeasibilityChecker has no such check (flown).",
)
def _jump_target(context: RuleContext) -> Iterator[Violation]:
    for step, item, target in _jumps(context):
        if target is None:
            yield at_item(step, f"there is no item {item.target}", "name the id of an earlier item", "target")
        elif target >= step.index:
            yield at_item(step, "a jump goes back: forward it would leave items out", "name an earlier item", "target")
        elif not _is_air_stop(context.plan.items[target]):
            message = f"{item.target} is no waypoint or loiter"
            yield at_item(step, message, "jump to a place, so that it is clear where the vehicle flies", "target")


@rules.error("jump.over_drop", "A drop already made is never visited again.", "Waydrop.")
def _jump_over_drop(context: RuleContext) -> Iterator[Violation]:
    for step, item, target in _jumps(context):
        if target is None:
            continue
        for drop in context.drops:
            if target <= drop.step.index < step.index:
                message = f"going back to {item.target} repeats the drop {drop.item.id}"
                yield at_item(step, message, "take the drop out of the loop", "target")


@rules.warning(
    "jump.nested",
    "PX4 counts a jump once for the whole mission: in the second round of an outer loop the inner one is used up.",
    "PX4 mission_base.cpp, do_jump_current_count.",
)
def _nested_jump(context: RuleContext) -> Iterator[Violation]:
    loops = [(step, target) for step, _, target in _jumps(context) if target is not None]
    for step, target in loops:
        for inner, _ in loops:
            if target <= inner.index < step.index:
                message = f"the jump {inner.item.id} inside this loop is only counted once for the whole flight"
                yield at_item(step, message, "write the repetitions out")


@rules.error(
    "jump.limit_not_judged",
    f"Only the first {MAX_VISITS} visits of items are predicted, so max_duration_s and the battery cannot be judged.",
    "Waydrop.",
)
def _limit_of_many_visits(context: RuleContext) -> Iterator[Violation]:
    judged = _judged_by_time(context)
    step = _too_often(context)
    if judged and step is not None:
        message = f"with its repeats the plan has more than {MAX_VISITS} visits: {judged} cannot be judged"
        yield at_item(step, message, "repeat it less often, or split the plan", "repeats")


@rules.warning(
    "jump.not_predicted",
    f"Only the first {MAX_VISITS} visits of items are predicted; the flight takes longer than its timeline.",
    "Waydrop.",
)
def _many_visits(context: RuleContext) -> Iterator[Violation]:
    step = _too_often(context)
    if step is not None and not _judged_by_time(context):
        message = f"with its repeats the plan has more than {MAX_VISITS} visits; the rest is not predicted"
        yield at_item(step, message, "repeat it less often, or split the plan", "repeats")


def _too_often(context: RuleContext) -> Step | None:
    """The jump that repeats most, if the flight is longer than its prediction."""
    jumps = [(step, item.repeats) for step, item, _ in _jumps(context)]
    if not jumps or not flown_order(context.plan).truncated:
        return None
    return max(jumps, key=lambda jump: jump[1])[0]


def _judged_by_time(context: RuleContext) -> str:
    """What the whole prediction is needed for; empty if nothing is limited."""
    performance, judged = context.facts.performance, []
    if context.plan.limits.max_duration_s is not None:
        judged.append("limits.max_duration_s")
    if performance is not None and performance.has_energy_rates:
        judged.append("the battery")
    return " and ".join(judged)


def _is_air_stop(item: PlanItem) -> bool:
    return item.is_stop and item.flies


def _jumps(context: RuleContext) -> Iterator[tuple[Step, Jump, int | None]]:
    for step in context.steps:
        if isinstance(step.item, Jump):
            yield step, step.item, context.plan.index_of(step.item.target)
