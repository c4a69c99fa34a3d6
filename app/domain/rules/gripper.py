"""Rules for grippers and winches: where a drop may occur, and what must precede it."""

from __future__ import annotations

from collections.abc import Iterator

from app.domain.items import ITEM_TYPES, Gripper, Item, Winch, type_of
from app.domain.rules.registry import RuleContext, RuleSet, Violation, at_item
from app.domain.vehicle.state import FlightRegime, VehicleType

rules = RuleSet()

_POSITION_HINT = "insert a waypoint, loiter or land item before it; only delay and change_speed items may be in between"


def _follows_position(kind: type[Item]) -> None:
    """Add the rule for one type of item that acts at the position of another item."""
    word = type_of(kind)

    @rules.error(
        f"{word}.must_follow_waypoint",
        f"A {word} item has no position: it acts as soon as the vehicle passes the item before it.",
        "Waydrop; PX4 has no such check.",
    )
    def check(context: RuleContext) -> Iterator[Violation]:
        for step in context.steps:
            if step.item.type == word and step.anchor is None:
                message = f"the {word} does not follow an item with a position, so it would act anywhere"
                yield at_item(step, message, _POSITION_HINT)


for _kind in ITEM_TYPES:
    if _kind.needs_stop and not _kind.waits:
        _follows_position(_kind)


@rules.error(
    "gripper.released_twice",
    "After a release the gripper stays open, even after landing. A second release has no effect.",
    "PX4 payload_deliverer: a release when released is acknowledged at once (flown).",
)
def _no_second_release(context: RuleContext) -> Iterator[Violation]:
    released_by: str | None = None
    for drop in context.drops:
        if not isinstance(drop.item, Gripper):
            continue
        if drop.item.grabs:
            released_by = None
        elif released_by is not None:
            message = f"the gripper was already released by {released_by}"
            yield at_item(drop.step, message, "add a grab between the two, or remove one of them")
        else:
            released_by = drop.item.id


@rules.warning(
    "winch.not_executed",
    "PX4 accepts DO_WINCH in missions but does not execute it.",
    "PX4 main; the documentation says that winches are not yet supported.",
)
def _winch_is_executed(context: RuleContext) -> Iterator[Violation]:
    for drop in () if context.autopilot.executes_winch else context.drops:
        if isinstance(drop.item, Winch):
            name = context.autopilot.name
            message = f"{name} accepts a winch item but does not execute it: that requires an external payload"
            yield at_item(drop.step, message, "check that the vehicle has a payload that executes DO_WINCH")


@rules.warning(
    "winch.supervised",
    "PX4 does not answer the command DO_WINCH, so a supervised drop would end as unknown.",
    "PX4 main; flown.",
)
def _winch_is_embedded(context: RuleContext) -> Iterator[Violation]:
    for drop in () if context.autopilot.commands_winch else context.drops:
        if isinstance(drop.item, Winch) and drop.supervised:
            message = f"{context.autopilot.name} does not answer winch commands outside the mission"
            yield at_item(drop.step, message, 'use "mode": "embedded"', "mode")


@rules.warning(
    "winch.contingency",
    "Telemetry does not show what a winch does, so its drop ends as unknown and the contingency is carried out.",
    "Waydrop.",
)
def _winch_ends_unknown(context: RuleContext) -> Iterator[Violation]:
    action = context.plan.contingency.on_drop_failure
    if action == "continue":
        return
    for number, drop in enumerate(context.drops, start=1):
        is_last = not any(later.releases for later in context.drops[number:])
        if is_last and action == "return":
            return  # nothing is left to deliver
        if isinstance(drop.item, Winch) and drop.releases and not drop.supervised:
            message = f'an embedded winch drop always ends as unknown, so "{action}" is commanded after it'
            hint = 'set "on_drop_failure": "continue"' + ("" if is_last else ", or give each parcel a plan of its own")
            yield at_item(drop.step, message, hint)


@rules.error("gripper.supervised_grab", "Only a release can be supervised; a grab is always embedded.", "Waydrop.")
def _grab_is_embedded(context: RuleContext) -> Iterator[Violation]:
    for drop in context.drops:
        if drop.item.grabs and drop.item.mode == "supervised":
            message = "a grab cannot be supervised: it is a mission item"
            yield at_item(drop.step, message, 'remove "mode"', "mode")


@rules.warning(
    "gripper.instance_ignored",
    "PX4 ignores the instance of DO_GRIPPER.",
    "PX4 payload_deliverer; flown with 0, 2 and -1.",
)
def _one_gripper(context: RuleContext) -> Iterator[Violation]:
    for drop in () if context.autopilot.takes_instance else context.drops:
        if isinstance(drop.item, Gripper) and drop.item.instance != 1:
            message = f"{context.autopilot.name} has one gripper and ignores the instance {drop.item.instance}"
            yield at_item(drop.step, message, "remove instance", "instance")


@rules.error(
    "gripper.not_enabled",
    "Without a valid gripper, the mission continues normally and nothing is released.",
    "PX4 PD_GRIPPER_TYPE; flown with -1.",
)
def _gripper_enabled(context: RuleContext) -> Iterator[Violation]:
    if context.vehicle is None or (off := context.behaviour.no_gripper) is None:
        return
    for drop in context.drops:
        if isinstance(drop.item, Gripper):
            message = f"the vehicle has no gripper ({off.name} is -1): it would continue as if it had released"
            yield at_item(drop.step, message, f"{off.remedy} and configure the gripper output")


def _is_enabled(context: RuleContext) -> bool:
    return context.vehicle is not None and context.behaviour.no_gripper is None


@rules.warning(
    "gripper.no_output",
    "Without an assigned output, every command is acknowledged and every item reached as if the gripper had moved.",
    "PX4 mixer_module: output function 430; flown without. A CAN gripper (uavcan hardpoint) has none either.",
)
def _gripper_has_output(context: RuleContext) -> Iterator[Violation]:
    output = context.behaviour.gripper_output
    if not _is_enabled(context) or output.assigned is not False:
        return
    for drop in context.drops:
        if isinstance(drop.item, Gripper):
            message = (
                f"no servo output is assigned to the gripper (no {output.settings} is {output.function}): the vehicle "
                "would acknowledge every command, and Waydrop cannot observe whether anything moves"
            )
            hint = f"set the gripper output to {output.function}; a gripper on CAN needs no output"
            yield at_item(drop.step, message, hint)


@rules.warning(
    "gripper.output_unknown",
    "A parameter that was not received is not 0: it is unknown whether the gripper has an output.",
    "Waydrop.",
)
def _gripper_output_is_known(context: RuleContext) -> Iterator[Violation]:
    output = context.behaviour.gripper_output
    if not _is_enabled(context) or output.assigned is not None:
        return
    silent = output.silent
    for drop in context.drops:
        if isinstance(drop.item, Gripper):
            named = silent[0] if len(silent) == 1 else f"{silent[0]} and {len(silent) - 1} more"
            message = f"whether a servo output is assigned to the gripper is unknown: {named} did not answer"
            yield at_item(drop.step, message, f"check that one {output.settings} is {output.function}")


@rules.error(
    "drop.firmware_too_old",
    "Before v1.14, PX4 rejects a mission with a gripper or winch item. Unknown firmware is assumed to be current.",
    "PX4 v1.13 mission items.",
)
def _firmware_takes_items(context: RuleContext) -> Iterator[Violation]:
    old = context.behaviour.too_old_for_drops
    if old is None:
        return
    for drop in context.drops:
        if not drop.supervised:
            message = f"{old.version} does not support {drop.item.type} items in missions and would reject the upload"
            yield at_item(drop.step, message, f"update the vehicle to {old.needed} or later")


@rules.error(
    "landed_drop.rtl_type",
    "The first LAND becomes the mission landing, which is a possible destination of a return with RTL_TYPE 1 to 4.",
    "PX4 rtl.cpp, RTL_TYPE.",
)
def _landed_drop_needs_rtl_home(context: RuleContext) -> Iterator[Violation]:
    returns = context.behaviour.returns
    if not (returns.to_landing or returns.may_follow_items):
        return
    for drop in context.drops:
        if drop.carried is FlightRegime.GROUND and drop.anchor is not None:
            message = f"with {returns.setting}, a return may go to this landing point instead of home"
            yield at_item(drop.step, message, returns.setting.remedy)


@rules.warning(
    "gripper.reverse_return",
    "With RTL_TYPE 4, or 2 without a landing, a return first executes the item before the current one, even a "
    "release that was skipped. A supervised drop is not a mission item.",
    "PX4 rtl_mission_fast_reverse.cpp.",
)
def _no_reverse_over_gripper(context: RuleContext) -> Iterator[Violation]:
    returns = context.behaviour.returns
    lands = any(item.is_stop and item.lands for item in context.plan.items)
    if not returns.along_items or (lands and not returns.turns_back):
        return
    for drop in context.drops:
        if isinstance(drop.item, Gripper) and not drop.supervised:
            message = f"with {returns.setting}, a return may fly back along the items, starting with this one"
            yield at_item(drop.step, message, returns.setting.remedy)


@rules.error(
    "landed_drop.fixed_wing",
    "A fixed wing needs a takeoff item to take off, and a second one makes the mission infeasible.",
    "PX4 FeasibilityChecker: takeoff must be the first waypoint item.",
)
def _landed_drop_takes_off_again(context: RuleContext) -> Iterator[Violation]:
    if context.plan.vehicle_type is not VehicleType.FIXED_WING:
        return
    for drop in context.drops:
        if drop.carried is FlightRegime.GROUND and drop.anchor is not None:
            message = "a fixed wing does not take off again after a landing within the mission"
            yield at_item(drop.step, message, "drop in flight, or end the plan with the landing")
