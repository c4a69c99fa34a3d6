"""Rules for grippers and winches: where a drop may stand, and what must have happened before it."""

from __future__ import annotations

from collections.abc import Iterator

from app.domain.items import ITEM_TYPES, Gripper, Item, Winch
from app.domain.items.document import type_of
from app.domain.rules.registry import Rule, RuleContext, Violation, at_item
from app.domain.validation.finding import Severity
from app.domain.vehicle.state import FlightRegime, VehicleType

_POSITION_HINT = "put a waypoint, loiter or land item before it; only delay and change_speed may stand between"


def _follows_position(kind: type[Item]) -> Rule:
    """The rule for one item type that acts where it stands."""
    word = type_of(kind)

    def check(context: RuleContext) -> Iterator[Violation]:
        for step in context.steps:
            if step.item.type == word and step.anchor is None:
                message = f"the {word} follows no position item: it would act wherever it is"
                yield at_item(step, message, _POSITION_HINT)

    return Rule(
        f"{word}.must_follow_waypoint",
        Severity.ERROR,
        f"A {word} item has no position of its own: it acts as soon as the item before it is passed.",
        "PX4 has no such check; the rule is ours alone.",
        check,
    )


def _no_second_release(context: RuleContext) -> Iterator[Violation]:
    released_by: str | None = None
    for drop in context.drops:
        if not isinstance(drop.item, Gripper):
            continue
        if drop.item.takes_up:
            released_by = None
        elif released_by is not None:
            message = f"the gripper was already released by {released_by}; there is nothing left to drop"
            yield at_item(drop.step, message, "grab a parcel between the two, or remove one of them")
        else:
            released_by = drop.item.id


def _winch_is_executed(context: RuleContext) -> Iterator[Violation]:
    for drop in () if context.autopilot.executes_winch else context.drops:
        if isinstance(drop.item, Winch):
            name = context.autopilot.name
            message = f"{name} accepts a winch item and executes nothing: only an external payload can"
            yield at_item(drop.step, message, "make sure that the vehicle carries a payload that executes DO_WINCH")


def _winch_is_embedded(context: RuleContext) -> Iterator[Violation]:
    for drop in () if context.autopilot.commands_winch else context.drops:
        if isinstance(drop.item, Winch) and drop.supervised:
            message = f"a winch commanded from outside the mission is answered UNSUPPORTED by {context.autopilot.name}"
            yield at_item(drop.step, message, 'use "mode": "embedded"', "mode")


def _grab_is_embedded(context: RuleContext) -> Iterator[Violation]:
    for drop in context.drops:
        if drop.item.takes_up and drop.item.mode == "supervised":
            message = "a grab cannot be supervised: it is an item of the mission"
            yield at_item(drop.step, message, 'leave "mode" out', "mode")


def _one_gripper(context: RuleContext) -> Iterator[Violation]:
    for drop in () if context.autopilot.takes_instance else context.drops:
        if isinstance(drop.item, Gripper) and drop.item.instance != 1:
            message = f"{context.autopilot.name} has one gripper and ignores the instance {drop.item.instance}"
            yield at_item(drop.step, message, "leave instance out", "instance")


def _gripper_enabled(context: RuleContext) -> Iterator[Violation]:
    if context.vehicle is None or (off := context.behaviour.no_gripper) is None:
        return
    for drop in context.drops:
        if isinstance(drop.item, Gripper):
            message = f"the vehicle has no gripper ({off.name} is -1): it would fly on as if it had released"
            yield at_item(drop.step, message, f"{off.mend} and configure the gripper's output")


def _is_enabled(context: RuleContext) -> bool:
    return context.vehicle is not None and context.behaviour.no_gripper is None


def _gripper_has_output(context: RuleContext) -> Iterator[Violation]:
    output = context.behaviour.gripper_output
    if not _is_enabled(context) or output.assigned is not False:
        return
    for drop in context.drops:
        if isinstance(drop.item, Gripper):
            message = (
                f"no servo output is assigned to the gripper (no {output.settings} is {output.function}): the vehicle "
                "would acknowledge everything, and Waydrop cannot see whether anything moves"
            )
            hint = f"set the gripper's output to {output.function}; a gripper on CAN looks alike and needs nothing"
            yield at_item(drop.step, message, hint)


def _gripper_output_is_known(context: RuleContext) -> Iterator[Violation]:
    output = context.behaviour.gripper_output
    if not _is_enabled(context) or output.assigned is not None:
        return
    silent = output.silent
    for drop in context.drops:
        if isinstance(drop.item, Gripper):
            named = silent[0] if len(silent) == 1 else f"{silent[0]} and {len(silent) - 1} more"
            message = f"whether a servo output is assigned to the gripper is not known: {named} did not answer"
            yield at_item(drop.step, message, f"make sure that one {output.settings} is {output.function}")


def _firmware_takes_items(context: RuleContext) -> Iterator[Violation]:
    old = context.behaviour.too_old_for_drops
    if old is None:
        return
    for drop in context.drops:
        if not drop.supervised:
            message = f"{old.version} takes no {drop.item.type} items in a mission: it would refuse the upload"
            yield at_item(drop.step, message, f"update the vehicle to {old.needed} or newer")


def _landed_drop_needs_rtl_home(context: RuleContext) -> Iterator[Violation]:
    returns = context.behaviour.returns
    if not (returns.to_landing or returns.may_follow_items):
        return
    for drop in context.drops:
        if drop.carried is FlightRegime.GROUND and drop.anchor is not None:
            message = f"with {returns.setting} a return may go to this landing place instead of home"
            yield at_item(drop.step, message, returns.setting.mend)


def _no_reverse_over_gripper(context: RuleContext) -> Iterator[Violation]:
    returns = context.behaviour.returns
    lands = any(item.is_stop and item.lands for item in context.plan.items)
    if not returns.along_items or (lands and not returns.turns_back):
        return
    for drop in context.drops:
        if isinstance(drop.item, Gripper) and not drop.supervised:
            message = f"with {returns.setting} a return may fly back along the items, and begin with this one"
            yield at_item(drop.step, message, returns.setting.mend)


def _landed_drop_takes_off_again(context: RuleContext) -> Iterator[Violation]:
    if context.plan.vehicle_type is not VehicleType.FIXED_WING:
        return
    for drop in context.drops:
        if drop.carried is FlightRegime.GROUND and drop.anchor is not None:
            message = "a fixed wing does not take off again after a landing in mid-plan"
            yield at_item(drop.step, message, "drop in flight, or end the plan with the landing")


RULES = (
    *(_follows_position(kind) for kind in ITEM_TYPES if kind.needs_stop and not kind.waits),
    Rule(
        "gripper.released_twice",
        Severity.ERROR,
        "After a release the gripper stays open, also after landing: a second release drops nothing.",
        "PX4 payload_deliverer: a release when released is acknowledged at once (flown).",
        _no_second_release,
    ),
    Rule(
        "gripper.supervised_grab",
        Severity.ERROR,
        "Only a release is decided on the spot; a grab is always embedded.",
        "The rule is ours alone.",
        _grab_is_embedded,
    ),
    Rule(
        "gripper.not_enabled",
        Severity.ERROR,
        "With an invalid gripper the mission carries on exactly alike and nothing is released.",
        "PX4 PD_GRIPPER_TYPE; flown with -1.",
        _gripper_enabled,
    ),
    Rule(
        "gripper.no_output",
        Severity.WARNING,
        "Without an assigned output everything is acknowledged and reached as if the gripper had moved.",
        "PX4 mixer_module: output function 430; flown without. A CAN gripper (uavcan hardpoint) has none either.",
        _gripper_has_output,
    ),
    Rule(
        "gripper.output_unknown",
        Severity.WARNING,
        "A parameter that does not answer is not 0: whether the gripper has an output stays open.",
        "The rule is ours alone.",
        _gripper_output_is_known,
    ),
    Rule(
        "drop.firmware_too_old",
        Severity.ERROR,
        "Before v1.14 a mission with a gripper or winch item is refused whole. Unknown firmware counts as current.",
        "PX4 v1.13 mission items; the simulated px4-1.13 refuses them.",
        _firmware_takes_items,
    ),
    Rule(
        "gripper.instance_ignored",
        Severity.WARNING,
        "The instance of DO_GRIPPER is not looked at.",
        "PX4 payload_deliverer; flown with 0, 2 and -1.",
        _one_gripper,
    ),
    Rule(
        "winch.not_executed",
        Severity.WARNING,
        "DO_WINCH is accepted in missions, but nothing on board executes it.",
        "PX4 main; the documentation says that winches are not yet supported.",
        _winch_is_executed,
    ),
    Rule(
        "winch.supervised",
        Severity.WARNING,
        "The autopilot answers DO_WINCH as a command with UNSUPPORTED, so a supervised drop ends unknown.",
        "PX4 main.",
        _winch_is_embedded,
    ),
    Rule(
        "landed_drop.rtl_type",
        Severity.ERROR,
        "The first LAND becomes the mission landing, to which RTL_TYPE 1 to 4 may return.",
        "PX4 rtl.cpp, RTL_TYPE.",
        _landed_drop_needs_rtl_home,
    ),
    Rule(
        "gripper.reverse_return",
        Severity.WARNING,
        "RTL_TYPE 2 without a landing, or 4, flies back and first executes the item before the current one: "
        "a release that was skipped too. A supervised drop is no item.",
        "PX4 rtl_mission_fast_reverse.cpp; the simulated vehicles do the same.",
        _no_reverse_over_gripper,
    ),
    Rule(
        "landed_drop.fixed_wing",
        Severity.ERROR,
        "A fixed wing needs a takeoff item to leave the ground, and a second one makes a mission infeasible.",
        "PX4 FeasibilityChecker: takeoff must be the first waypoint item.",
        _landed_drop_takes_off_again,
    ),
)
