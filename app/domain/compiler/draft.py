"""The list in which mission items get their numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from app.domain.errors import PlanRejectedError
from app.domain.items.draft import Draft
from app.domain.mission import MissionItem


@dataclass(slots=True)
class DraftList:
    """Items in flying order, each with the plan item that it came from."""

    drafts: list[Draft] = field(default_factory=list)
    owners: list[str] = field(default_factory=list)

    def add(self, owner: str, draft: Draft) -> int:
        """Append; the seq that the item will have."""
        self.drafts.append(draft)
        self.owners.append(owner)
        return len(self.drafts) - 1

    @property
    def next_seq(self) -> int:
        return len(self.drafts)

    def number(self) -> tuple[MissionItem, ...]:
        """Contiguous items; the first is current; jumps point at the first item of their target."""
        first: dict[str, int] = {}
        for seq, owner in enumerate(self.owners):
            first.setdefault(owner, seq)
        return tuple(_numbered(seq, draft, first) for seq, draft in enumerate(self.drafts))

    def plan_item_of(self) -> Mapping[int, str]:
        return dict(enumerate(self.owners))


def _numbered(seq: int, draft: Draft, first: Mapping[str, int]) -> MissionItem:
    param1 = draft.params[0]
    if draft.jump_to is not None:
        if draft.jump_to not in first:
            raise PlanRejectedError(f"the jump's target {draft.jump_to} is no item of the mission")
        param1 = float(first[draft.jump_to])
    return MissionItem(
        seq,
        draft.frame,
        draft.command,
        param1,
        *draft.params[1:],
        x=draft.x,
        y=draft.y,
        z=draft.z,
        current=seq == 0,
    )
