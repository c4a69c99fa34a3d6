"""Items put into a plan: always between two stops, so that no drop comes to lie at another place than planned."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, Final

from app.domain.errors import NotFoundError
from app.domain.finding import Finding
from app.domain.plan.document import Plan
from app.domain.plan.items import ChangeSpeed, Delay, Gripper, PlanItem, Winch
from app.domain.plan.parse import PlanInvalid, parse_plan

_ITEM: Final = re.compile(r"/items/(\d+)")
_AT_A_STOP = (ChangeSpeed, Delay, Gripper, Winch)
"""What belongs to the position item before it."""


def with_items(plan: Plan, items: Sequence[Any], *, at: str, after: bool) -> tuple[Plan, tuple[str, ...]]:
    """The plan with more items before or after the stop of the item `at`, and the ids that the new ones got.

    Raises NotFoundError, and PlanInvalid with pointers into `{"items": items}`.
    """
    index = plan.index_of(at)
    if index is None:
        raise NotFoundError(f"the plan has no item {at!r}", hint="GET the run's plan: its items have ids")
    place = _behind_stop(plan.items, index) if after else _before_stop(plan.items, index)
    document = plan.model_dump(mode="json")
    document["items"][place:place] = list(items)
    try:
        changed = parse_plan(document)
    except PlanInvalid as error:
        raise PlanInvalid([_in_what_was_given(finding, items, place) for finding in error.findings]) from None
    return changed, tuple(item.id for item in changed.items[place : place + len(items)])


def _in_what_was_given(finding: Finding, items: Sequence[Any], place: int) -> Finding:
    """The finding with its place among the new items; where two have one id it is found at the later one."""
    match = _ITEM.match(finding.pointer)
    index = int(match[1]) - place if match else -1
    if match and 0 <= index < len(items):
        return finding.model_copy(update={"pointer": f"/items/{index}{finding.pointer[match.end() :]}"})
    same = (f"/items/{number}/id" for number, item in enumerate(items) if _id_of(item) == finding.item_id is not None)
    return finding.model_copy(update={"pointer": next(same, "/items")})


def _id_of(item: Any) -> Any:
    return item.get("id") if isinstance(item, dict) else None


def _before_stop(items: Sequence[PlanItem], index: int) -> int:
    while index > 0 and isinstance(items[index], _AT_A_STOP):
        index -= 1
    return index


def _behind_stop(items: Sequence[PlanItem], index: int) -> int:
    index += 1
    while index < len(items) and isinstance(items[index], _AT_A_STOP):
        index += 1
    return index
