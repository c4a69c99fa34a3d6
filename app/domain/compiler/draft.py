"""A mission item before it has a number, and the list in which items get theirs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from app.domain.errors import PlanRejectedError
from app.domain.mission import NAN, MavCmd, MavFrame, MissionItem
from app.domain.plan.fields import Altitude
from app.domain.plan.walk import Place


@dataclass(frozen=True, slots=True)
class Draft:
    """One MISSION_ITEM_INT without seq. `jump_to` is the id of a jump's target; it becomes param1."""

    command: MavCmd
    frame: MavFrame
    params: tuple[float, float, float, float]
    x: int = 0
    y: int = 0
    z: float = 0.0
    jump_to: str | None = None


def command_draft(command: MavCmd, *params: float, jump_to: str | None = None) -> Draft:
    """An item without a position. Frame MISSION: PX4 refuses DO_ commands in a global frame. What is not given is NaN,

    because 0 can mean something (0 in DO_GRIPPER is RELEASE) and PX4 keeps these parameters as they are.
    """
    first, second, third, fourth = (*params, NAN, NAN, NAN, NAN)[:4]
    return Draft(command, MavFrame.MISSION, (first, second, third, fourth), jump_to=jump_to)


def position_draft(
    command: MavCmd, altitude: Altitude, place: Place, params: tuple[float, float, float, float]
) -> Draft:
    """An item with a position. The _INT frames, because those are what PX4 reads back for integer items.

    A parameter that the command does not use is 0 here: PX4 does not keep it and reads back 0.
    """
    absolute = altitude.absolute_altitude_m
    return Draft(
        command,
        MavFrame.GLOBAL_RELATIVE_ALT_INT if absolute is None else MavFrame.GLOBAL_INT,
        params,
        x=degrees_e7(place.latitude_deg),
        y=degrees_e7(place.longitude_deg),
        z=altitude.relative_altitude_m or 0.0 if absolute is None else absolute,
    )


def degrees_e7(degrees: float) -> int:
    """The integer of the wire: 1e7 to a degree."""
    return round(degrees * 1e7)


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
