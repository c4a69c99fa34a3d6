"""How each drop of a plan is meant: where it belongs, who commands it, and whether the vehicle can stand there."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from app.domain.carried import Carried
from app.domain.items import Drop, DropItem
from app.domain.items.alternate import Alternate
from app.domain.plan.walk import Step

CAN_HOLD = frozenset({Carried.GROUND, Carried.ROTARY_WING, Carried.WHEELS})
"""What carries a vehicle that can stand still: a wing or a balloon in the wind cannot."""

CAN_GO_ON = frozenset({Carried.ROTARY_WING, Carried.WHEELS})
"""What can go from the place of a failed drop to another one with no more than a waypoint: not from the ground."""


@dataclass(frozen=True, slots=True)
class DropUse:
    """One drop of the walk. `anchor` is its position step, None if it follows none. `first` at that place.

    `delayed`: the plan waits there (a delay item) before it drops.
    """

    step: Step
    item: DropItem
    anchor: Step | None
    first: bool
    supervised: bool
    delayed: bool = False

    @property
    def releases(self) -> bool:
        """It lets a parcel go: only such a drop has an outcome. A grab or a retract has none."""
        return self.item.lets_go

    @property
    def alternate(self) -> Alternate | None:
        """The other place for the parcel, where there can be one: a supervised release in the air or on wheels."""
        reachable = self.supervised and self.releases and self.anchor is not None and self.carried in CAN_GO_ON
        return self.item.other_place() if reachable else None

    @property
    def stopped(self) -> bool:
        """The plan wants the vehicle to stand while it drops."""
        return self.item.release_motion == "stopped"

    @property
    def carried(self) -> Carried:
        """What carries the vehicle during the drop."""
        return self.step.before

    @property
    def can_hold(self) -> bool:
        """The vehicle can stand there."""
        return self.carried in CAN_HOLD


def drops_of(steps: Iterable[Step]) -> tuple[DropUse, ...]:
    """The drops of a walk, in order."""
    found: list[DropUse] = []
    by_index: dict[int, Step] = {}
    last: Step | None = None
    delayed = False
    for step in steps:
        by_index[step.index] = step
        if isinstance(step.item, Drop):
            anchor = by_index.get(step.anchor) if step.anchor is not None else None
            first = last is None or last.anchor != step.anchor or step.index < last.index
            found.append(DropUse(step, step.item, anchor, first, is_supervised(step.item, step.before), delayed))
            last, delayed = step, False
        elif step.anchor == step.index:
            last, delayed = None, False
        elif step.item.waits:
            delayed = True
    return tuple(found)


def is_supervised(item: Drop, carried: Carried) -> bool:
    """Whether Waydrop commands this drop. Default: a gripper wherever the vehicle can stand.

    A winch is embedded by default: PX4 itself executes none, only an external payload that hears the mission's item.
    A grab is always an item of the mission: there is nothing to decide about it on the spot.
    """
    if item.takes_up:
        return False
    if item.mode is not None:
        return item.mode == "supervised"
    return item.usually_supervised and item.release_motion == "stopped" and carried in CAN_HOLD
