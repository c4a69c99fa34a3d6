"""Which of a mission's gripper items has its turn: one output shows them all, and each drop must know its own."""

from __future__ import annotations

from dataclasses import dataclass

from app.domain.mission import CompiledDrop, MavCmd, Mission
from app.domain.progress import Progress

_RELEASE = 0.0


@dataclass(frozen=True, slots=True)
class GripperTurns:
    """The place of one embedded drop among the mission's gripper items, as sequence numbers.

    `approach_seq` is the first item of its approach, `earlier_seq` the last release before its own (-1: none),
    `grab_seq` and `next_seq` the first grab and the first release after it (None: none).
    """

    approach_seq: int
    release_seq: int
    earlier_seq: int = -1
    grab_seq: int | None = None
    next_seq: int | None = None

    @classmethod
    def of(cls, drop: CompiledDrop, mission: Mission) -> GripperTurns:
        """The turns of an embedded drop. A supervised release happens in its hold."""
        own = drop.resume_seq if drop.release_seq is None else drop.release_seq
        items = [item for item in mission.items if item.command is MavCmd.DO_GRIPPER]
        releases = {item.seq for item in items if item.param2 == _RELEASE}
        supervised = [other for other in mission.drops if other.supervised]
        supervised += [other.alternate for other in supervised if other.alternate is not None]
        releases |= {max(other.hold_seqs) for other in supervised}
        grabs = {item.seq for item in items if item.param2 != _RELEASE}
        return cls(
            approach_seq=min(drop.hold_seqs),
            release_seq=own,
            earlier_seq=max((seq for seq in releases if seq < own), default=-1),
            grab_seq=min((seq for seq in grabs if seq > own), default=None),
            next_seq=min((seq for seq in releases if seq > own), default=None),
        )

    def has_passed(self, progress: Progress) -> bool:
        """Whether the release is passed in this visit."""
        return progress.passed_to >= self.release_seq

    def is_at_item(self, progress: Progress) -> bool:
        """Whether the mission is at the drop: on its way to it, or in it."""
        return progress.current is not None and self.approach_seq <= progress.current <= self.release_seq

    def has_earlier_passed(self, progress: Progress) -> bool:
        """Whether no other release is to come before this one."""
        return progress.passed_to >= self.earlier_seq

    def is_regrabbed(self, progress: Progress) -> bool:
        """Whether a later grab is being done, or passed."""
        return _had_its_turn(self.grab_seq, progress)

    def is_reopened(self, progress: Progress) -> bool:
        """Whether a later release is being done, or passed."""
        return _had_its_turn(self.next_seq, progress)


def _had_its_turn(seq: int | None, progress: Progress) -> bool:
    return seq is not None and (progress.passed_to >= seq or progress.current == seq)
