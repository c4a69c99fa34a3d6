"""A drop that is an item of the mission: it is only watched, and its outcome inferred."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

from app.domain.drop import DropPhase, DropRecord
from app.domain.embedded_drop import EmbeddedDrop, EmbeddedSight
from app.domain.gripper_turns import GripperTurns
from app.domain.mission import CompiledDrop, MavCmd
from app.domain.progress import Progress
from app.domain.reason import Reason, ReasonCode, because
from app.domain.supervised import Finish
from app.domain.vehicle import VehicleState
from app.services.runs.evidence import Look, finished, where, with_output
from app.services.runs.orders import Order, failure_order

SURELY_SEEN_S: Final = 1.2
"""An item shows as passed this much late, in vehicle time: MISSION_CURRENT comes at 1 Hz."""
LONGEST_BLINK_S: Final = 1.0
"""Looks further apart, or positions older than this, are a gap in which anything may have happened."""


class EmbeddedRelease:
    """A drop that is an item of the mission: it is only watched.

    `taken_up`: the flight went on without us before, so that the item may have passed unseen.
    """

    def __init__(
        self,
        compiled: CompiledDrop,
        record: DropRecord,
        on_failure: str,
        gripper: GripperTurns,
        *,
        taken_up: bool = False,
    ) -> None:
        self.compiled = compiled
        self.record = record
        self._on_failure = on_failure
        self._gripper = gripper
        self._drop = EmbeddedDrop()
        self._state = VehicleState()
        self._seen_since_s = math.inf if taken_up else -math.inf
        self._looked_at_s: float | None = None
        self._where: dict[str, object] | None = None

    @property
    def is_over(self) -> bool:
        """See Release."""
        return self.record.phase is DropPhase.DONE

    @property
    def is_active(self) -> bool:
        """See Release."""
        return False

    @property
    def is_busy(self) -> bool:
        """See Release."""
        return self._drop.passed_at_s is not None and not self.is_over

    def look(self, seen: Look, progress: Progress) -> tuple[Order, ...]:
        """See Release."""
        if self.is_over:
            return ()
        state = seen.state
        has_gripper = self.compiled.command is MavCmd.DO_GRIPPER
        self._drop = self._drop.saw(
            EmbeddedSight(
                now_s=seen.now_s,
                connected=state.connected,
                passed=self._gripper.has_passed(progress),
                output_us=state.gripper_output_us if has_gripper else None,
                output_age_s=state.gripper_output_age_s if has_gripper else None,
                at_item=self._gripper.is_at_item(progress),
                earlier_passed=self._gripper.has_earlier_passed(progress),
                regrabbed=self._gripper.is_regrabbed(progress),
                reopened=self._gripper.is_reopened(progress),
                has_output=state.has_gripper_output if has_gripper else None,
                has_gripper=has_gripper,
            )
        )
        self._state = state
        self.record = with_output(self.record, self.compiled, state)
        self._note_where(seen)
        if self._drop.finish is not None:
            self._finish(seen, self._drop.finish, has_gripper=has_gripper)
            failure = failure_order(self.record, self._on_failure, state)
            return (failure,) if failure else ()
        return ()

    def end(self, reason: Reason, now_s: float) -> None:
        """See Release."""
        self._drop = self._drop.ended(reason)
        if self._drop.finish is not None and not self.is_over:
            self.record = with_output(finished(self.record, self._drop.finish), self.compiled, self._state)

    def _note_where(self, seen: Look) -> None:
        """At the first sign of the release, where the vehicle is; nothing if that sign may be old by now."""
        age_s = seen.state.position_age_s
        pause_s = 0.0 if self._looked_at_s is None else seen.now_s - self._looked_at_s
        self._looked_at_s = seen.now_s
        if pause_s > LONGEST_BLINK_S or age_s is None or age_s > LONGEST_BLINK_S or self._seen_since_s == math.inf:
            self._seen_since_s = seen.now_s
        if self._where is not None or (self._drop.passed_at_s is None and self._drop.finish is None):
            return
        surely_s = SURELY_SEEN_S / max(seen.clock_rate, 1.0)
        self._where = where(seen, self.compiled) if seen.now_s - self._seen_since_s >= surely_s else {}
        self.record = self.record.model_copy(update=self._where)

    def _finish(self, seen: Look, finish: Finish, *, has_gripper: bool) -> None:
        output_us, age_s = seen.state.gripper_output_us, seen.state.gripper_output_age_s
        changes = (
            {"output_us": output_us, "output_at": seen.time_s - age_s} if has_gripper and age_s is not None else {}
        )
        if not self._where:
            finish = replace(finish, reason=because(ReasonCode.ITEM_UNSEEN_PLACE, finish.reason))
        self.record = with_output(finished(self.record.model_copy(update=changes), finish), self.compiled, seen.state)
