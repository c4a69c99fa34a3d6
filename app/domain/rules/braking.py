"""Rules for the motion at a drop: what each kind of vehicle can do, against what the plan expects."""

from __future__ import annotations

from collections.abc import Iterator

from app.domain.autopilot import Quantity
from app.domain.plan.compiler import STOP_RADIUS_M
from app.domain.plan.drops import DropUse
from app.domain.rules.registry import Rule, RuleContext, Violation, at_item
from app.domain.validation.finding import Severity
from app.domain.vehicle.state import FlightRegime

MAX_STOP_RADIUS_M = 2.0
"""A stop with a larger acceptance radius is reached while still moving."""
_NAME = {
    FlightRegime.FIXED_WING: "in fixed-wing flight the vehicle",
    FlightRegime.BUOYANCY: "an airship",
    FlightRegime.WHEELS: "a rover",
}


def _can_stop(context: RuleContext) -> Iterator[Violation]:
    for drop in _placed(context):
        if drop.stopped and not drop.can_hold:
            message = f"{_NAME[drop.carried]} cannot stop, but the drop expects it"
            hint = 'use "release_motion": "moving" and pass or circle the place'
            if context.plan.vehicle_type == "vtol":
                hint = "put a transition to multicopter before the waypoint, or use release_motion moving"
            yield at_item(drop.step, message, hint, "release_motion")


def _supervised_needs_hold(context: RuleContext) -> Iterator[Violation]:
    for drop in _placed(context):
        if drop.supervised and not drop.can_hold:
            message = f"{_NAME[drop.carried]} cannot hold, so nobody can supervise the drop there"
            yield at_item(drop.step, message, 'use "mode": "embedded"', "mode")


def _supervised_needs_stop(context: RuleContext) -> Iterator[Violation]:
    for drop in _placed(context):
        if drop.supervised and drop.can_hold and not drop.stopped:
            message = "a supervised drop happens while the vehicle holds, but the plan says that it moves"
            hint = 'use "release_motion": "stopped", or "mode": "embedded"'
            yield at_item(drop.step, message, hint, "release_motion")


def _rover_stops_by_delay(context: RuleContext) -> Iterator[Violation]:
    for drop in _placed(context):
        if drop.carried is FlightRegime.WHEELS and drop.stopped and not drop.supervised and not _delayed(context, drop):
            message = "a rover passes its waypoint without stopping: only a delay item stops it"
            yield at_item(drop.step, message, "put a delay item between the waypoint and the drop")


def _moving_really_moves(context: RuleContext) -> Iterator[Violation]:
    for drop in _placed(context):
        if not drop.stopped and drop.can_hold and _stands(context, drop):
            message = "the plan makes the vehicle wait here, but the drop says that it moves"
            yield at_item(
                drop.step, message, 'use "release_motion": "stopped", or take the wait away', "release_motion"
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
            message = f"with an acceptance radius of {reach_m:g} m the vehicle would still move"
            hint = f"use at most {MAX_STOP_RADIUS_M:g} m, or leave it out ({STOP_RADIUS_M:g} m is used)"
            yield at_item(drop.anchor, message, hint, "acceptance_radius_m")


def _offset_can_be_met(context: RuleContext) -> Iterator[Violation]:
    for drop in _placed(context):
        wanted_m, expected_m = drop.item.max_offset_m, _expected_offset_m(context, drop)
        if wanted_m is not None and expected_m > wanted_m:
            message = (
                f"the drop will act about {expected_m:.1f} m away from the point, but at most {wanted_m:g} m is allowed"
            )
            yield at_item(drop.step, message, "fly slower, stop for the drop, or allow more", "max_offset_m")


def _hold_ignored(context: RuleContext) -> Iterator[Violation]:
    for step in context.steps:
        if step.item.hovers_s() > 0 and step.after is not FlightRegime.ROTARY_WING:
            message = "only a rotary wing holds at a waypoint; here hold_s is ignored"
            hint = "use a delay item" if step.after is FlightRegime.WHEELS else "use a loiter item of kind time"
            yield at_item(step, message, hint, "hold_s")


def _placed(context: RuleContext) -> Iterator[DropUse]:
    """Drops at a place; one without a place is another rule's business."""
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
    item = drop.anchor.item
    if item.circles() and drop.carried not in (FlightRegime.ROTARY_WING, FlightRegime.WHEELS):
        return abs(item.circle_radius_m() or context.behaviour.quantity(Quantity.LOITER_RADIUS_M))
    if drop.stopped and drop.carried is FlightRegime.ROTARY_WING:
        return STOP_RADIUS_M
    speed_m_s = context.speeds_m_s[drop.step.index] if drop.carried is FlightRegime.FIXED_WING else 0.0
    return context.behaviour.reach_m(drop.carried, speed_m_s, item.reach_m())


RULES = (
    Rule(
        "braking.cannot_stop",
        Severity.ERROR,
        "Brake_for_hold is for rotary wings only; a wing or an airship flies on while it drops.",
        "PX4 package delivery page; mission_block.cpp.",
        _can_stop,
    ),
    Rule(
        "braking.supervised_needs_hold",
        Severity.ERROR,
        "A supervised drop is commanded during a hold; a vehicle that cannot hold is past before the answer comes.",
        "Design of the supervised drop.",
        _supervised_needs_hold,
    ),
    Rule(
        "braking.supervised_needs_stop",
        Severity.ERROR,
        "A supervised drop is released only when the vehicle stands.",
        "Design of the supervised drop.",
        _supervised_needs_stop,
    ),
    Rule(
        "braking.rover_needs_delay",
        Severity.ERROR,
        "A rover ignores the hold of a waypoint: it released 1.1 to 1.3 m early at 2.1 m/s; a delay stops it.",
        "PX4 mission_block.cpp (flown).",
        _rover_stops_by_delay,
    ),
    Rule(
        "braking.moving_but_waits",
        Severity.ERROR,
        "release_motion contradicts the items before the drop, so one of them is not what was meant.",
        "Ours.",
        _moving_really_moves,
    ),
    Rule(
        "braking.radius_too_large",
        Severity.ERROR,
        "A hold without a small acceptance radius does not stop in time: 0.9 m before the point at 1.5 m/s.",
        "Flown: only hold and a radius of 1 m together stop at the point.",
        _stop_radius,
    ),
    Rule(
        "drop.offset_not_reachable",
        Severity.ERROR,
        "What counts as reached depends on vehicle type and speed: a plane switches about 2.24 s before its waypoint.",
        "PX4 NPFG switch distance (flown); L1 guidance before v1.14: 4.77 s.",
        _offset_can_be_met,
    ),
    Rule(
        "braking.hold_ignored",
        Severity.WARNING,
        "Hold on a waypoint counts only in rotary-wing state.",
        "PX4 mission_block.cpp.",
        _hold_ignored,
    ),
)
