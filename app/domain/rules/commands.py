"""Rules for items that a vehicle cannot do, and for items that are never flown."""

from __future__ import annotations

from collections.abc import Iterator

from app.domain.carried import Carried
from app.domain.finding import Severity
from app.domain.items import Jump, Loiter, PlanItem
from app.domain.plan.walk import Step
from app.domain.rules.registry import Rule, RuleContext, Violation, at_item


def _loiter_turns(context: RuleContext) -> Iterator[Violation]:
    for step in () if context.autopilot.takes_turns else context.steps:
        if isinstance(step.item, Loiter) and step.item.turns is not None:
            message = f"{context.autopilot.name} does not take a number of turns"
            yield at_item(step, message, 'use "kind": "time" with duration_s', "kind")


def _never_reached(context: RuleContext) -> Iterator[Violation]:
    for step in context.steps[:-1]:
        following = context.plan.items[step.index + 1]
        if step.item.goes_home:
            yield at_item(step, f"the flight ends with this item; {following.id} is never flown", "move it to the end")
        elif step.item.never_ends():
            message = f"this loiter never ends; {following.id} is never flown"
            yield at_item(step, message, 'use "kind": "time" with duration_s, or move it to the end', "kind")


def _delay_in_the_air(context: RuleContext) -> Iterator[Violation]:
    for step in context.steps:
        if step.item.waits and step.before in (Carried.FIXED_WING, Carried.BUOYANCY):
            message = "the vehicle does not stand during this delay"
            yield at_item(step, message, "use a loiter item of kind time")


def _jump_target(context: RuleContext) -> Iterator[Violation]:
    for step, item, target in _jumps(context):
        if target is None:
            yield at_item(step, f"there is no item {item.target}", "name the id of an earlier item", "target")
        elif target >= step.index:
            yield at_item(step, "a jump goes back: forward it would leave items out", "name an earlier item", "target")
        elif not _is_air_stop(context.plan.items[target]):
            message = f"{item.target} is no waypoint or loiter"
            yield at_item(step, message, "jump to a place, so that it is clear where the vehicle flies", "target")


def _jump_over_drop(context: RuleContext) -> Iterator[Violation]:
    for step, item, target in _jumps(context):
        if target is None:
            continue
        for drop in context.drops:
            if target <= drop.step.index < step.index:
                message = f"going back to {item.target} repeats the drop {drop.item.id}"
                yield at_item(step, message, "take the drop out of the loop", "target")


def _nested_jump(context: RuleContext) -> Iterator[Violation]:
    loops = [(step, target) for step, _, target in _jumps(context) if target is not None]
    for step, target in loops:
        for inner, _ in loops:
            if target <= inner.index < step.index:
                message = f"the jump {inner.item.id} inside this loop is only counted once for the whole flight"
                yield at_item(step, message, "write the repetitions out")


def _is_air_stop(item: PlanItem) -> bool:
    return item.is_stop and item.flies


def _jumps(context: RuleContext) -> Iterator[tuple[Step, Jump, int | None]]:
    for step in context.steps:
        if isinstance(step.item, Jump):
            yield step, step.item, context.plan.index_of(step.item.target)


RULES = (
    Rule(
        "loiter.turns_unsupported",
        Severity.ERROR,
        "NAV_LOITER_TURNS (18) is not among the commands that PX4 accepts.",
        "PX4 FeasibilityChecker: unsupported command.",
        _loiter_turns,
    ),
    Rule(
        "commands.never_flown",
        Severity.ERROR,
        "Items after a return or after an endless loiter are accepted and never flown.",
        "PX4 accepts items after RTL without complaint (flown).",
        _never_reached,
    ),
    Rule(
        "delay.does_not_stop",
        Severity.WARNING,
        "NAV_DELAY waits for time to pass; what cannot hover flies on meanwhile.",
        "PX4 mission_block.cpp.",
        _delay_in_the_air,
    ),
    Rule(
        "jump.target",
        Severity.ERROR,
        "PX4 accepts a DO_JUMP to an item that does not exist.",
        "PX4 FeasibilityChecker has no such check (flown).",
        _jump_target,
    ),
    Rule(
        "jump.over_drop",
        Severity.ERROR,
        "A drop already made is never visited again.",
        "Ours.",
        _jump_over_drop,
    ),
    Rule(
        "jump.nested",
        Severity.WARNING,
        "PX4 counts a jump once for the whole mission: in the second round of an outer loop the inner one is used up.",
        "PX4 mission_base.cpp, do_jump_current_count.",
        _nested_jump,
    ),
)
