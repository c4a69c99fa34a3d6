"""Where a track goes on after the current item, and when a multicopter has to stop there instead."""

from __future__ import annotations

from collections.abc import Sequence

from app.simulator.mission.item import TAKEOFF_COMMANDS, Item
from app.simulator.navigator.context import NavContext
from app.simulator.navigator.jumps import JumpCounter
from app.simulator.navigator.target import Target, target_of
from app.simulator.wire import Cmd

PAYLOAD_COMMANDS = (Cmd.DO_GRIPPER, Cmd.DO_WINCH)


def next_target(context: NavContext, items: Sequence[Item], seq: int, jumps: JumpCounter) -> Target | None:
    """The next position item, over DO_ items and by the jumps; None makes the vehicle stop at the current one."""
    if brakes(context, items[seq], items[seq + 1 :]):
        return None
    for _ in items:
        following = jumps.resolve(items, seq + 1, counts=False)
        if following is None:
            return None
        seq, candidate = following, items[following]
        if candidate.command in TAKEOFF_COMMANDS:
            return None
        if candidate.has_position:
            return target_of(candidate, context.frame, context.home, context.params)
    return None


def brakes(context: NavContext, item: Item, following: Sequence[Item]) -> bool:
    """PX4's brake_for_hold: a hold time in rotary-wing state, or no autocontinue.

    Up to v1.15 also a gripper item right behind; since then its time-out never reaches the rule, because the item
    has no position.
    """
    if not item.autocontinue:
        return True
    if not context.hovers:
        return False
    if item.command == Cmd.NAV_WAYPOINT and item.param1 > 0.0:
        return True
    gripper_next = bool(following) and following[0].command in PAYLOAD_COMMANDS
    return context.profile.gripper_items_brake and gripper_next
