"""The order in which a plan's items are flown, as PX4's navigator takes its jumps."""

from __future__ import annotations

from dataclasses import dataclass

from app.domain.items import Jump
from app.domain.plan.document import Plan

MAX_VISITS = 5000
"""Nested jumps can ask for millions; nobody flies or draws those."""


@dataclass(frozen=True, slots=True)
class FlownOrder:
    """Indexes of items, jumps left out. `open_ended`: stops at a loiter that never ends."""

    indexes: tuple[int, ...]
    open_ended: bool
    truncated: bool


def flown_order(plan: Plan) -> FlownOrder:
    """Each jump goes back `repeats` times in the whole mission: PX4 does not reset its counter in a nested loop."""
    index_of = {item.id: index for index, item in enumerate(plan.items)}
    left = {item.id: item.repeats for item in plan.items if isinstance(item, Jump)}
    visited: list[int] = []
    index = 0
    while index < len(plan.items):
        item = plan.items[index]
        if len(visited) >= MAX_VISITS:
            return FlownOrder(tuple(visited), open_ended=False, truncated=True)
        if isinstance(item, Jump):
            if left[item.id] > 0 and item.target in index_of:
                left[item.id] -= 1
                index = index_of[item.target]
            else:
                index += 1
            continue
        visited.append(index)
        if item.goes_home or item.never_ends():
            return FlownOrder(tuple(visited), open_ended=item.never_ends(), truncated=False)
        index += 1
    return FlownOrder(tuple(visited), open_ended=False, truncated=False)
