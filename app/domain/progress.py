"""How far a vehicle is in its mission, from MISSION_CURRENT and MISSION_ITEM_REACHED, per visit.

PX4 repeats REACHED about ten times and may also lose it, and an item may be current for 20 ms only. So an item counts
as passed when a later one is current or when it, or a later one, was reached. With jumps an item is visited again.

The two overtake each other by up to a second: PX4's links share the item that they last showed, so the link that does
not notice its change first shows it a second later, and what changes at once comes as MISSION_CURRENT before REACHED.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from app.domain.mission import MavCmd, Mission, MissionItem
from app.domain.vehicle import FlightMode, VehicleState


@dataclass(frozen=True, slots=True)
class Progress:
    """`current` is the item being flown; `passed_to` the highest seq passed in this visit (-1: none).

    `shown` is what MISSION_CURRENT said last: only its own steps back are a way back. `left_to` is how far the visit
    before a way back came, whose REACHED may come late. `jumps` maps a DO_JUMP to where it leads: to its target, or
    further if that is no place. `flown` holds the plan items passed, in order, once per visit. Law: it only grows. What
    lies in one of the `detours` counts only if the vehicle was seen there: the mission jumps over it.
    """

    last_seq: int
    jumps: Mapping[int, range]
    plan_item_of: Mapping[int, str]
    detours: tuple[range, ...] = ()
    current: int | None = None
    shown: int | None = None
    left_to: int = -1
    passed_to: int = -1
    flown: tuple[str, ...] = field(default=())

    @classmethod
    def of(cls, mission: Mission) -> Progress:
        """The progress before the start."""
        jumps = {item.seq: _landing(mission, item) for item in mission.items if item.command is MavCmd.DO_JUMP}
        last_seq = len(mission.items) - 1
        return cls(last_seq=last_seq, jumps=jumps, plan_item_of=mission.plan_item_of, detours=mission.detours)

    @property
    def item_id(self) -> str | None:
        """The plan item that is being flown."""
        return None if self.current is None else self.plan_item_of.get(self.current)

    @property
    def is_complete(self) -> bool:
        """Whether the last item was passed."""
        return self.passed_to >= self.last_seq

    def is_behind(self, state: VehicleState, mission_id: int | None) -> bool:
        """Whether a vehicle that holds now names this mission and is further in it than it was seen."""
        named = mission_id is not None and state.mission_id == mission_id
        ahead = self.current is not None and (state.mission_seq or 0) > self.current
        return named and ahead and state.mode is FlightMode.HOLD

    def now_current(self, seq: int) -> Progress:
        """MISSION_CURRENT shows `seq`. Going back along a jump passes what lay before the jump."""
        if seq == self.shown or not 0 <= seq <= self.last_seq:
            return self
        before, now = self.shown, replace(self, shown=seq)
        if before is not None and seq < before:
            return now._gone_back(seq)
        return now.begun(seq)

    def begun(self, seq: int) -> Progress:
        """`seq` is being flown, whatever told it. Never a way back: MISSION_CURRENT may only come later."""
        if self.current is not None and seq <= self.current:
            return self
        return replace(self._passed(seq - 1, seen_at=seq), current=seq)

    def reached(self, seq: int) -> Progress:
        """MISSION_ITEM_REACHED says `seq`: it and all before it in this visit are passed."""
        if self.current is not None and self.current < seq <= self.left_to:
            return self  # of the visit before, or it counts as soon as it is current
        return self._passed(min(seq, self.last_seq))

    def completed(self) -> Progress:
        """MISSION_CURRENT.mission_state says complete: the last item is passed."""
        return self._passed(self.last_seq)

    def also_flown(self, plan_item_id: str, *, through_seq: int) -> Progress:
        """A supervised drop is over: its hold is passed, and then the drop, unless it was itself the hold (a delay)."""
        passed = self._passed(through_seq)
        if passed.flown[-1:] == (plan_item_id,):
            return passed
        return replace(passed, flown=(*passed.flown, plan_item_id))

    def _gone_back(self, seq: int) -> Progress:
        over = [at for at, landing in self.jumps.items() if seq in landing and at >= (self.current or 0)]
        before = self._passed(min(over) - 1) if over else self
        back_to = self.jumps[min(over)].start if over else seq
        back = replace(before, current=back_to, passed_to=back_to - 1, left_to=before.passed_to)
        return back.begun(seq)

    def _passed(self, seq: int, seen_at: int | None = None) -> Progress:
        flown = list(self.flown)
        previous = self.plan_item_of.get(self.passed_to)
        seen_at = seq if seen_at is None else seen_at
        skipped = [detour for detour in self.detours if seen_at not in detour and self.current not in detour]
        for passing in range(self.passed_to + 1, seq + 1):
            item_id = self.plan_item_of.get(passing)
            if any(passing in detour for detour in skipped):
                continue
            if item_id is not None and item_id != previous and passing not in self.jumps:
                flown.append(item_id)
            previous = item_id
        return replace(self, passed_to=max(self.passed_to, seq), flown=tuple(flown))


def _landing(mission: Mission, jump: MissionItem) -> range:
    """The target of a jump, and what may be shown in its stead: DO_ items are current for a moment only."""
    target = end = int(jump.param1)
    while end < jump.seq and mission.items[end].command.name.startswith("DO_"):
        end += 1
    return range(target, end + 1)
