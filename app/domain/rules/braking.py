"""Rules for the motion at a drop: what the plan expects against what the vehicle can do."""

from __future__ import annotations

from collections.abc import Iterator

from app.domain.drop.consent import SHORTEST_HOLD_S, SHORTEST_STANDING_HOLD_S
from app.domain.plan.compiler import STOP_RADIUS_M, bound_s
from app.domain.plan.drops import DropUse
from app.domain.rules.registry import RuleContext, RuleSet, Violation, at_item
from app.domain.vehicle.state import FlightRegime

rules = RuleSet()

MAX_STOP_RADIUS_M = 2.0
"""With a larger acceptance radius, the vehicle is still moving when it reaches the waypoint."""
_STANDING = (FlightRegime.GROUND, FlightRegime.WHEELS)
_NAME = {
    FlightRegime.FIXED_WING: "in fixed-wing flight the vehicle",
    FlightRegime.BUOYANCY: "an airship",
    FlightRegime.WHEELS: "a rover",
}


@rules.error(
    "braking.cannot_stop",
    "Brake_for_hold applies to rotary wings only. A fixed wing or an airship keeps moving while it drops.",
    "PX4 package delivery page; mission_block.cpp.",
)
def _can_stop(context: RuleContext) -> Iterator[Violation]:
    for drop in _placed(context):
        if drop.stopped and not drop.can_hold:
            message = f"{_NAME[drop.carried]} cannot stop, but the drop requires it"
            hint = 'use "release_motion": "moving" and pass or circle the position'
            if context.plan.vehicle_type == "vtol":
                hint = "insert a transition to multicopter before the waypoint, or use release_motion moving"
            yield at_item(drop.step, message, hint, "release_motion")


@rules.error(
    "braking.supervised_needs_hold",
    "A supervised drop is commanded during a hold. Without one, the vehicle has passed before the answer arrives.",
    "Waydrop: supervised drops.",
)
def _supervised_needs_hold(context: RuleContext) -> Iterator[Violation]:
    for drop in _placed(context):
        if drop.supervised and not drop.can_hold:
            message = f"{_NAME[drop.carried]} cannot hold, so the drop cannot be supervised"
            yield at_item(drop.step, message, 'use "mode": "embedded"', "mode")


@rules.error(
    "braking.supervised_needs_stop", "A supervised drop is released only at rest.", "Waydrop: supervised drops."
)
def _supervised_needs_stop(context: RuleContext) -> Iterator[Violation]:
    for drop in _placed(context):
        if drop.supervised and drop.can_hold and not drop.stopped:
            message = "a supervised drop requires a hold, but release_motion is moving"
            hint = 'use "release_motion": "stopped", or "mode": "embedded"'
            yield at_item(drop.step, message, hint, "release_motion")


@rules.error(
    "drop.hold_too_short",
    f"A supervised drop needs a hold of {SHORTEST_HOLD_S:g} s, to detect the hold, come to rest and release, and of "
    f"{SHORTEST_STANDING_HOLD_S:g} s on the ground or on wheels. In a shorter hold the parcel is often kept on board.",
    "Flown: nothing was released in 3 s. Simulated: released in 4 s on the ground and on wheels.",
)
def _hold_is_long_enough(context: RuleContext) -> Iterator[Violation]:
    for drop in _placed(context):
        needed_s = SHORTEST_STANDING_HOLD_S if drop.carried in _STANDING else SHORTEST_HOLD_S
        if drop.supervised and drop.item.consent == "none" and bound_s(drop) < needed_s:
            message = f"the hold of {bound_s(drop):g} s may end before the parcel can be released"
            yield at_item(drop.step, message, f"set hold_s to at least {needed_s:g}", "hold_s")


@rules.error(
    "braking.rover_needs_delay",
    "A rover ignores the hold of a waypoint: it released 1.1 to 1.3 m early at 2.1 m/s. A delay stops it.",
    "PX4 mission_block.cpp (flown).",
)
def _rover_stops_by_delay(context: RuleContext) -> Iterator[Violation]:
    for drop in _placed(context):
        if drop.carried is FlightRegime.WHEELS and drop.stopped and not drop.supervised and not _delayed(context, drop):
            message = "a rover does not stop at a waypoint: only a delay item stops it"
            yield at_item(drop.step, message, "insert a delay item between the waypoint and the drop")


@rules.error(
    "braking.moving_but_waits",
    "release_motion contradicts the items before the drop, so one of them is a mistake.",
    "Waydrop.",
)
def _moving_really_moves(context: RuleContext) -> Iterator[Violation]:
    for drop in _placed(context):
        if not drop.stopped and drop.can_hold and _stands(context, drop):
            message = "the plan makes the vehicle wait here, but release_motion is moving"
            yield at_item(drop.step, message, 'use "release_motion": "stopped", or remove the wait', "release_motion")


@rules.error(
    "drop.after_delay",
    "A fixed wing or an airship keeps flying during a delay, so where it releases afterwards cannot be predicted.",
    "Flown: 20 to 49 m from the predicted place.",
)
def _no_delay_in_passing(context: RuleContext) -> Iterator[Violation]:
    for drop in _placed(context):
        if drop.delayed and not drop.can_hold:
            message = f"{_NAME[drop.carried]} keeps flying during the delay before this drop"
            yield at_item(drop.step, message, "remove the delay, or circle before the drop with a loiter of kind time")


@rules.error(
    "braking.radius_too_large",
    "Without a small acceptance radius, a hold stops too late: 0.9 m before the point at 1.5 m/s.",
    "Flown: only a hold together with a radius of 1 m stops at the point.",
)
def _stop_radius(context: RuleContext) -> Iterator[Violation]:
    for drop in _placed(context):
        assert drop.anchor is not None
        reach_m = drop.anchor.item.reach_m()
        if (
            drop.stopped
            and drop.carried is FlightRegime.ROTARY_WING
            and reach_m is not None
            and reach_m > MAX_STOP_RADIUS_M
        ):
            message = f"with an acceptance radius of {reach_m:g} m, the vehicle is still moving at the drop"
            hint = f"use at most {MAX_STOP_RADIUS_M:g} m, or remove it (default: {STOP_RADIUS_M:g} m)"
            yield at_item(drop.anchor, message, hint, "acceptance_radius_m")


@rules.error(
    "drop.offset_not_reachable",
    "When a waypoint counts as reached depends on vehicle type and speed: a plane switches about 2.24 s before it.",
    "PX4 NPFG switch distance (flown); L1 guidance before v1.14: 4.77 s.",
)
def _offset_can_be_met(context: RuleContext) -> Iterator[Violation]:
    for drop in _placed(context):
        wanted_m, expected_m = drop.item.max_offset_m, _expected_offset_m(context, drop)
        if wanted_m is not None and expected_m > wanted_m:
            message = f"the drop is expected {expected_m:.1f} m from the point, more than the allowed {wanted_m:g} m"
            yield at_item(drop.step, message, "fly slower, stop for the drop, or increase max_offset_m", "max_offset_m")


@rules.warning("braking.hold_ignored", "The hold of a waypoint applies to rotary wings only.", "PX4 mission_block.cpp.")
def _hold_ignored(context: RuleContext) -> Iterator[Violation]:
    for step in context.steps:
        if step.item.hovers_s() > 0 and step.after is not FlightRegime.ROTARY_WING:
            message = "only a rotary wing holds at a waypoint; hold_s is ignored here"
            hint = "use a delay item" if step.after is FlightRegime.WHEELS else "use a loiter item of kind time"
            yield at_item(step, message, hint, "hold_s")


def _placed(context: RuleContext) -> Iterator[DropUse]:
    """Return the drops that have a position. Other rules report those without one."""
    return (drop for drop in context.drops if drop.anchor is not None)


def _delayed(context: RuleContext, drop: DropUse) -> bool:
    assert drop.anchor is not None
    between = context.plan.items[drop.anchor.index + 1 : drop.step.index]
    return any(item.waits for item in between)


def _stands(context: RuleContext, drop: DropUse) -> bool:
    assert drop.anchor is not None
    item = drop.anchor.item
    waits = drop.carried is FlightRegime.GROUND or _delayed(context, drop)
    if drop.carried is FlightRegime.ROTARY_WING:
        waits = waits or item.circles() or item.hovers_s() > 0
    return waits


def _expected_offset_m(context: RuleContext, drop: DropUse) -> float:
    assert drop.anchor is not None
    if drop.stopped and drop.carried is FlightRegime.ROTARY_WING:
        return STOP_RADIUS_M
    if drop.carried in (FlightRegime.FIXED_WING, FlightRegime.BUOYANCY):
        predicted_m = [found.offset_m for found in context.timeline().drops if found.item_id == drop.item.id]
        return max(predicted_m, default=0.0)  # none: a return or a loiter without end comes before it
    return context.behaviour.reach_m(drop.carried, 0.0, drop.anchor.item.reach_m())
