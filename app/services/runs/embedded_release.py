"""A drop that is an item of the mission: it is only watched, and its outcome inferred."""

from __future__ import annotations

from app.domain.drop import DropPhase, DropRecord
from app.domain.embedded_drop import EmbeddedDrop, EmbeddedSight
from app.domain.gripper_turns import GripperTurns
from app.domain.mission import CompiledDrop, MavCmd
from app.domain.progress import Progress
from app.services.runs.evidence import Look, finished, where
from app.services.runs.orders import Order, failure_order


class EmbeddedRelease:
    """A drop that is an item of the mission: it is only watched."""

    def __init__(self, compiled: CompiledDrop, record: DropRecord, on_failure: str, gripper: GripperTurns) -> None:
        self.compiled = compiled
        self.record = record
        self._on_failure = on_failure
        self._gripper = gripper
        self._drop = EmbeddedDrop()

    @property
    def is_over(self) -> bool:
        """See Release."""
        return self.record.phase is DropPhase.DONE

    @property
    def is_active(self) -> bool:
        """See Release."""
        return False

    def look(self, seen: Look, progress: Progress) -> tuple[Order, ...]:
        """See Release."""
        if self.is_over:
            return ()
        state = seen.state
        has_gripper = self.compiled.command is MavCmd.DO_GRIPPER
        before = self._drop
        self._drop = before.saw(
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
            )
        )
        first_pass = self._drop.passed_at_s is not None and before.passed_at_s is None
        if first_pass or (self._drop.finish is not None and self.record.offset_m is None):
            self.record = self.record.model_copy(update=where(seen, self.compiled))
        if self._drop.finish is not None:
            changes = {"output_us": state.gripper_output_us, "output_at": seen.time_s} if has_gripper else {}
            self.record = finished(self.record.model_copy(update=changes), self._drop.finish)
            failure = failure_order(self.record, self._on_failure, state)
            return (failure,) if failure else ()
        return ()

    def end(self, reason: str, now_s: float) -> None:
        """See Release."""
        self._drop = self._drop.ended(reason)
        if self._drop.finish is not None and not self.is_over:
            self.record = finished(self.record, self._drop.finish)
