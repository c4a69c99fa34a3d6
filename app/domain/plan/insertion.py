"""Items put into a plan: always between two stops, so that no drop comes to lie at another place than planned."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from app.domain.errors import NotFoundError
from app.domain.finding import Finding
from app.domain.items import PlanItem
from app.domain.plan.document import Plan
from app.domain.plan.parse import PlanInvalid, parse_plan


def with_items(plan: Plan, items: Sequence[Any], *, at: str, after: bool) -> tuple[Plan, tuple[str, ...]]:
    """The plan with more items before or after the stop of the item `at`, and the ids that the new ones got.

    Raises NotFoundError, and PlanInvalid with pointers into `{"items": items}`.
    """
    index = plan.index_of(at)
    if index is None:
        raise NotFoundError(f"the plan has no item {at!r}", hint="GET the run's plan: its items have ids")
    place = _behind_stop(plan.items, index) if after else _before_stop(plan.items, index)
    document = plan.model_dump(mode="json")
    parse_plan({**document, "items": list(items)})  # by themselves, so that findings point to them as they were given
    document["items"][place:place] = list(items)
    try:
        changed = parse_plan(document)
    except PlanInvalid as error:
        raise PlanInvalid([_at_new_item(finding, items) for finding in error.findings]) from None
    return changed, tuple(item.id for item in changed.items[place : place + len(items)])


def _at_new_item(finding: Finding, items: Sequence[Any]) -> Finding:
    """What is wrong with the whole alone is an id that is used twice, or how many items there are."""
    ids = [item.get("id") if isinstance(item, dict) else None for item in items]
    known = finding.item_id is not None and finding.item_id in ids
    return finding.model_copy(update={"pointer": f"/items/{ids.index(finding.item_id)}" if known else "/items"})


def _before_stop(items: Sequence[PlanItem], index: int) -> int:
    while index > 0 and items[index].stays:
        index -= 1
    return index


def _behind_stop(items: Sequence[PlanItem], index: int) -> int:
    index += 1
    while index < len(items) and items[index].stays:
        index += 1
    return index
