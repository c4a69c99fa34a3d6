"""The progress of a mission, per visit, from MISSION_CURRENT and MISSION_ITEM_REACHED.

PX4 repeats REACHED about ten times and may also lose it, and an item may be current for only 20 ms. An item therefore
counts as passed when a later one is current, or when it or a later one was reached. With jumps, items are revisited.

The two messages overtake each other by up to a second: PX4's links share the item that they last sent, so one link
sends a change a second late, and an immediate change is sent as MISSION_CURRENT before REACHED.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from app.domain.drop.supervised_inputs import OtherGripperItems
from app.domain.events.run import RunItemEnded
from app.domain.mission import CompiledDrop, MavCmd, Mission, MissionItem
from app.domain.vehicle.state import FlightMode, MissionState, VehicleState

# Whether "complete" in MISSION_CURRENT refers to the mission.
#
# PX4 uses the state for all modes. Land mode entered by a failsafe reports complete at touchdown, and Takeoff mode at
# its altitude, with any mission stored (recordings 22, 25). The state stays when the vehicle disarms and switches to
# Hold. A mission that ends with a landing item stays in Mission mode, one that ends with a return item is in Return
# mode.


_OTHER_ENDS: Final = frozenset({FlightMode.LAND, FlightMode.DESCEND, FlightMode.TAKEOFF})


@dataclass(frozen=True, slots=True)
class MissionCompleteDetector:
    """`of_other_mode`: complete was first reported in Land or Takeoff mode, and ever since."""

    is_reported: bool = False
    of_other_mode: bool = False

    def seen(self, state: VehicleState) -> MissionCompleteDetector:
        """Return the state after an observation of a connected vehicle."""
        if state.mission_state is not MissionState.COMPLETE:
            return MissionCompleteDetector()
        if self.is_reported:
            return self
        return replace(self, is_reported=True, of_other_mode=state.mode in _OTHER_ENDS)

    def is_done(self, state: VehicleState, *, last_seq: int) -> bool:
        return self.is_reported and not self.of_other_mode and state.mission_seq == last_seq


@dataclass(frozen=True, slots=True)
class MissionProgress:
    """`current` is the current item; `passed_to` the highest seq passed in this visit (-1: none).

    `shown` is the last MISSION_CURRENT: only its own steps back count as going back. `left_to` is how far the visit
    before a step back had come, whose REACHED may arrive late. `jumps` maps a DO_JUMP to its target, or further if that
    is not a position. `flown` has the plan items passed, in order, once per visit. Law: it only grows. Items of
    `detours` count only if the vehicle was observed there, because the mission skips them.
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
    def of(cls, mission: Mission) -> MissionProgress:
        """The progress before the start."""
        jumps = {item.seq: _landing(mission, item) for item in mission.items if item.command is MavCmd.DO_JUMP}
        last_seq = len(mission.items) - 1
        return cls(last_seq=last_seq, jumps=jumps, plan_item_of=mission.plan_item_of, detours=mission.detours)

    @property
    def item_id(self) -> str | None:
        """The current plan item."""
        return None if self.current is None else self.plan_item_of.get(self.current)

    @property
    def is_complete(self) -> bool:
        """Whether the last item was passed."""
        return self.passed_to >= self.last_seq

    def is_behind(self, state: VehicleState, mission_id: int | None) -> bool:
        """Whether a holding vehicle reports this mission and is further in it than observed so far."""
        named = mission_id is not None and state.mission_id == mission_id
        ahead = self.current is not None and (state.mission_seq or 0) > self.current
        return named and ahead and state.mode is FlightMode.HOLD

    def now_current(self, seq: int) -> MissionProgress:
        """MISSION_CURRENT is `seq`. A step back along a jump passes the items before the jump."""
        if seq == self.shown or not 0 <= seq <= self.last_seq:
            return self
        before, now = self.shown, replace(self, shown=seq)
        if before is not None and seq < before:
            return now._gone_back(seq)
        return now.begun(seq)

    def begun(self, seq: int) -> MissionProgress:
        """`seq` is current, by any source. Never a step back, because MISSION_CURRENT may arrive late."""
        if self.current is not None and seq <= self.current:
            return self
        return replace(self._passed(seq - 1, seen_at=seq), current=seq)

    def reached(self, seq: int) -> MissionProgress:
        """MISSION_ITEM_REACHED is `seq`: this item and all before it are passed in this visit."""
        if self.current is not None and self.current < seq <= self.left_to:
            return self  # of the previous visit, or it counts as soon as it is current
        return self._passed(min(seq, self.last_seq))

    def completed(self) -> MissionProgress:
        """MISSION_CURRENT.mission_state is complete: the last item is passed."""
        return self._passed(self.last_seq)

    def also_flown(self, plan_item_id: str, *, through_seq: int) -> MissionProgress:
        """A supervised drop has ended: its hold is passed, and then the drop, unless the drop is the hold itself (a
        delay).
        """
        passed = self._passed(through_seq)
        is_hold = self.plan_item_of.get(through_seq) == plan_item_id
        if is_hold and (self.passed_to >= through_seq or plan_item_id in passed.flown[len(self.flown) :]):
            return passed
        return replace(passed, flown=(*passed.flown, plan_item_id))

    def _gone_back(self, seq: int) -> MissionProgress:
        over = [at for at, landing in self.jumps.items() if seq in landing and at >= (self.current or 0)]
        before = self._passed(min(over) - 1) if over else self
        back_to = self.jumps[min(over)].start if over else seq
        back = replace(before, current=back_to, passed_to=back_to - 1, left_to=before.passed_to)
        return back.begun(seq)

    def _passed(self, seq: int, seen_at: int | None = None) -> MissionProgress:
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
    """The target of a jump, and the item that may be shown instead: DO_ items are current for a moment only."""
    target = end = int(jump.param1)
    while end < jump.seq and mission.items[end].command.name.startswith("DO_"):
        end += 1
    return range(target, end + 1)


_RELEASE = 0.0


@dataclass(frozen=True, slots=True)
class GripperTurns:
    """The position of an embedded drop among the gripper items of the mission, as sequence numbers.

    `approach_seq` is the first item of its approach, `settled_seq` the last of its own items, `earlier_seq` the last
    release before it and `loaded_seq` the last grab (-1: none), `grab_seq` and `next_seq` the first grab and the first
    release after it (None: none).
    """

    approach_seq: int
    release_seq: int
    settled_seq: int
    earlier_seq: int = -1
    loaded_seq: int = -1
    grab_seq: int | None = None
    next_seq: int | None = None

    @classmethod
    def of(cls, drop: CompiledDrop, mission: Mission) -> GripperTurns:
        """Return the turn of an embedded drop."""
        own = drop.resume_seq if drop.release_seq is None else drop.release_seq
        releases, grabs = _gripper_seqs(mission)
        return cls(
            approach_seq=min(drop.hold_seqs),
            release_seq=own,
            settled_seq=max(own, drop.resume_seq - 1),
            earlier_seq=max((seq for seq in releases if seq < own), default=-1),
            loaded_seq=max((seq for seq in grabs if seq < own), default=-1),
            grab_seq=min((seq for seq in grabs if seq > own), default=None),
            next_seq=min((seq for seq in releases if seq > own), default=None),
        )

    def has_passed(self, progress: MissionProgress) -> bool:
        """Whether the release is passed in this visit."""
        return progress.passed_to >= self.release_seq

    def has_settled(self, progress: MissionProgress) -> bool:
        """Whether the time that the plan gives the drop is over, too."""
        return progress.passed_to >= self.settled_seq

    def is_at_item(self, progress: MissionProgress) -> bool:
        """Whether the mission is approaching or executing the drop."""
        return progress.current is not None and self.approach_seq <= progress.current <= self.release_seq

    def has_earlier_passed(self, progress: MissionProgress) -> bool:
        """Whether all releases before this one are passed."""
        return progress.passed_to >= self.earlier_seq

    def is_loaded(self, progress: MissionProgress) -> bool:
        """Whether the last thing that the mission does with the gripper before the drop is a grab, and is done."""
        is_closed = self.loaded_seq > self.earlier_seq or self.earlier_seq < 0
        return is_closed and self.has_earlier_passed(progress) and progress.passed_to >= self.loaded_seq

    def is_reloaded(self, progress: MissionProgress) -> bool:
        """Whether the mission grabs between the item where it is and the drop."""
        return progress.current is not None and progress.current < self.loaded_seq

    def is_regrabbed(self, progress: MissionProgress) -> bool:
        """Whether a later grab is current or passed."""
        return _had_its_turn(self.grab_seq, progress)

    def is_reopened(self, progress: MissionProgress) -> bool:
        """Whether a later release is current or passed."""
        return _had_its_turn(self.next_seq, progress)


def _gripper_seqs(mission: Mission) -> tuple[frozenset[int], frozenset[int]]:
    """Where the mission releases and where it grabs. A supervised release happens in its hold."""
    items = [item for item in mission.items if item.command is MavCmd.DO_GRIPPER]
    releases = {item.seq for item in items if item.param2 == _RELEASE}
    supervised = [drop for drop in mission.drops if drop.supervised]
    supervised += [drop.alternate for drop in supervised if drop.alternate is not None]
    releases |= {max(drop.hold_seqs) for drop in supervised}
    return frozenset(releases), frozenset({item.seq for item in items if item.param2 != _RELEASE})


def other_gripper_items(mission: Mission, drop: CompiledDrop, *, is_doubtful: bool) -> OtherGripperItems:
    """The gripper items of the mission besides a supervised drop.

    Its alternate is one of them only if it `is_doubtful` what the drop did: after an unanswered release nobody goes
    there.
    """
    releases, grabs = _gripper_seqs(mission)
    own = {max(drop.hold_seqs)}
    if drop.alternate is not None and not is_doubtful:
        own.add(max(drop.alternate.hold_seqs))
    returns = any(item.command is MavCmd.DO_JUMP and item.param1 <= item.seq for item in mission.items)
    return OtherGripperItems(releases - own, grabs, returns)


def _had_its_turn(seq: int | None, progress: MissionProgress) -> bool:
    return seq is not None and (progress.passed_to >= seq or progress.current == seq)


# Start and end of each item on the vehicle's clock, from telemetry.
#
# PX4 reports some items as reached before they are done: a landing above its point, a return when it begins, a VTOL's
# takeoff and transition after the turn. Those end when the next item is current, or with the landing.


REPORTED_EARLY: Final = frozenset(
    {
        MavCmd.NAV_LAND,
        MavCmd.NAV_VTOL_LAND,
        MavCmd.NAV_RETURN_TO_LAUNCH,
        MavCmd.NAV_VTOL_TAKEOFF,
        MavCmd.DO_VTOL_TRANSITION,
    }
)


@dataclass(frozen=True, slots=True)
class ItemTimes:
    """`seqs` are the first and last mission item of each plan item, `early` those that are reported early.

    `counted` is the number of flown items that have ended. `ahead`: the next one has already ended, at a release.
    `began_s`: start of the current item, None if not observed. `paused_s`: time paused since.
    """

    seqs: Mapping[str, tuple[int, int]]
    early: frozenset[str]
    counted: int = 0
    began_s: float | None = None
    ahead: bool = False
    paused_s: float = 0.0

    @classmethod
    def of(cls, mission: Mission) -> ItemTimes:
        """Before the start."""
        seqs: dict[str, tuple[int, int]] = {}
        for seq, item_id in sorted(mission.plan_item_of.items()):
            seqs[item_id] = (seqs.get(item_id, (seq, seq))[0], seq)
        commands = {item.seq: item.command for item in mission.items}
        early = frozenset(item_id for item_id, (_, last) in seqs.items() if commands.get(last) in REPORTED_EARLY)
        return cls(seqs, early)

    def started(self, now_s: float | None) -> ItemTimes:
        """The first item begins."""
        return self._next(now_s)

    def paused(self, seconds: float) -> ItemTimes:
        """The run was paused for this long, in the current item."""
        return replace(self, paused_s=self.paused_s + max(0.0, seconds))

    def recovered(self, flown: int, *, ahead: bool = False) -> ItemTimes:
        """The first `flown` items were not observed by this process."""
        return replace(self._next(None), counted=flown, ahead=ahead)

    def beginning(self, began_s: float | None) -> ItemTimes:
        """The current item begins then; None if nobody saw it."""
        return replace(self, began_s=began_s)

    def flown_on(self, mission: Mission, began_s: float | None) -> ItemTimes:
        """Another mission continues after the counted items. Its first item begins then."""
        return replace(ItemTimes.of(mission), counted=self.counted, began_s=began_s)

    def releases(self, anchor_id: str, now_s: float | None) -> tuple[ItemTimes, tuple[RunItemEnded, ...]]:
        """A supervised release is commanded: the item where the vehicle waits is over, and the drop begins."""
        if self.ahead:
            return self, ()
        ended = RunItemEnded(item_id=anchor_id, began_s=self.began_s, ended_s=now_s, paused_s=self.paused_s)
        return replace(self._next(now_s), ahead=True), (ended,)

    def seen(
        self, progress: MissionProgress, now_s: float | None, *, landed: bool, gap: bool
    ) -> tuple[ItemTimes, tuple[RunItemEnded, ...]]:
        """Return the visits that ended since the last observation. `gap`: telemetry was interrupted, so times are
        unknown.
        """
        times, ended = self, []
        while times.counted < len(progress.flown):
            item_id = progress.flown[times.counted]
            is_newest = times.counted == len(progress.flown) - 1
            if is_newest and times._is_under_way(item_id, progress) and not (landed and item_id in times.early):
                break
            at_s = None if gap else now_s
            if not times.ahead:
                ended.append(
                    RunItemEnded(item_id=item_id, began_s=times.began_s, ended_s=at_s, paused_s=times.paused_s)
                )
                times = times._next(at_s)
            times = replace(times, counted=times.counted + 1, ahead=False)
        if gap and times.counted > self.counted:
            times = replace(times, began_s=None)
        return times, tuple(ended)

    def _next(self, began_s: float | None) -> ItemTimes:
        return replace(self, began_s=began_s, paused_s=0.0)

    def _is_under_way(self, item_id: str, progress: MissionProgress) -> bool:
        """Whether only part of its mission items are passed, or it is reported as reached but still in progress."""
        first, last = self.seqs.get(item_id, (0, -1))
        if first <= progress.passed_to < last:
            return True
        is_current = progress.current is None or progress.current <= last
        return item_id in self.early and progress.passed_to >= last and is_current
