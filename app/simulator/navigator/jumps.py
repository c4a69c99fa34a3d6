"""DO_JUMP: which item comes next, and how often a jump was taken."""

from __future__ import annotations

from collections.abc import Sequence

from app.simulator.mission.item import Item
from app.simulator.wire import Cmd

FOREVER = 65535
"""DO_JUMP with repeat -1, as PX4 stores it."""


class JumpCounter:
    """Counts the jumps of one mission; reset with a new mission or a new start."""

    def __init__(self) -> None:
        self._taken: dict[int, int] = {}
        self._changed: int | None = None

    def reset(self) -> None:
        """Begin to count again."""
        self._taken.clear()

    def take_changed(self) -> int | None:
        """The jump that was counted last, once."""
        changed, self._changed = self._changed, None
        return changed

    def after(self, items: Sequence[Item], seq: int) -> int | None:
        """The item after `seq`, or None at the end of the mission."""
        return self.resolve(items, seq + 1)

    def resolve(self, items: Sequence[Item], seq: int, *, counts: bool = True) -> int | None:
        """`seq` itself, or where the jumps from there lead. None past the end or for jumps in a circle.

        `counts`: they are taken; else it is only looked where they would lead.
        """
        for _ in range(len(items) + 1):
            if not 0 <= seq < len(items):
                return None
            item = items[seq]
            if item.command != Cmd.DO_JUMP:
                return seq
            limit = FOREVER if item.param2 < 0 else int(item.param2)
            if self._taken.get(seq, 0) < limit:
                if counts and limit != FOREVER:
                    self._taken[seq] = self._taken.get(seq, 0) + 1
                    self._changed = seq
                seq = int(item.param1)
            else:
                seq += 1
        return None
