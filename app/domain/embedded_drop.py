"""The embedded drop: the gripper is a mission item, and its outcome is inferred from what is seen.

No COMMAND_ACK of a mission's gripper item reaches a ground station, and MISSION_ITEM_REACHED comes without a gripper
too (px4-facts, package delivery 3 and 7). The one usable sign is SERVO_OUTPUT_RAW of the gripper's output.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from app.domain.drop import Certainty, DropOutcome
from app.domain.supervised.inputs import Finish
from app.domain.supervised.terms import GRIPPER_CLOSED_US, GRIPPER_OPEN_US

OUTPUT_WAIT_S = 2.0
OUTPUT_FRESH_S = 2.0


@dataclass(frozen=True, slots=True)
class EmbeddedSight:
    """What is seen of an embedded drop at `now_s`. `passed` says that its release item is passed in this visit."""

    now_s: float
    connected: bool
    passed: bool
    output_us: int | None
    output_age_s: float | None

    @property
    def output(self) -> int | None:
        """The gripper's output while it is fresh."""
        fresh = self.output_age_s is not None and self.output_age_s <= OUTPUT_FRESH_S
        return self.output_us if fresh and self.connected else None


@dataclass(frozen=True, slots=True)
class EmbeddedDrop:
    """The state of one embedded drop. `was_closed` is set once the output was seen at grab in this flight."""

    was_closed: bool = False
    passed_at_s: float | None = None
    finish: Finish | None = None

    def saw(self, seen: EmbeddedSight) -> EmbeddedDrop:
        """The state after a look. After the end nothing changes."""
        if self.finish is not None:
            return self
        drop = self
        if seen.output == GRIPPER_CLOSED_US:
            drop = replace(drop, was_closed=True)
        if seen.passed and drop.passed_at_s is None:
            drop = replace(drop, passed_at_s=seen.now_s)
        if seen.output == GRIPPER_OPEN_US:
            return drop._opened(seen)
        if drop.passed_at_s is None or not seen.connected or seen.now_s - drop.passed_at_s < OUTPUT_WAIT_S:
            return drop
        return drop._not_opened(seen)

    def ended(self, reason: str) -> EmbeddedDrop:
        """The run ends: a drop whose item was not passed is kept, any other that was not seen is unknown."""
        if self.finish is not None:
            return self
        if self.passed_at_s is None:
            return self._over(DropOutcome.KEPT, Certainty.INFERRED, f"its item was not reached: {reason}")
        return self._over(DropOutcome.UNKNOWN, Certainty.NONE, f"its item passed unseen: {reason}")

    def _opened(self, seen: EmbeddedSight) -> EmbeddedDrop:
        if self.was_closed:
            return self._over(DropOutcome.RELEASED, Certainty.INFERRED, "the gripper's output went to release")
        if not seen.passed:
            return self  # open since before the flight: nothing is said until the item passes
        reason = "the gripper was open before its item"
        return self._over(DropOutcome.UNKNOWN, Certainty.NONE, reason)

    def _not_opened(self, seen: EmbeddedSight) -> EmbeddedDrop:
        if seen.output == GRIPPER_CLOSED_US:
            reason = "its item passed, but the gripper's output stayed at grab"
            return self._over(DropOutcome.KEPT, Certainty.INFERRED, reason)
        reason = "its item passed, but the gripper's output is not known"
        return self._over(DropOutcome.UNKNOWN, Certainty.NONE, reason)

    def _over(self, outcome: DropOutcome, certainty: Certainty, reason: str) -> EmbeddedDrop:
        return replace(self, finish=Finish(outcome, certainty, reason))
