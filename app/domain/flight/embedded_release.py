"""A drop that is a mission item: only observed, with an inferred outcome."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from app.domain.drop.embedded import OUTPUT_LAG_S, EmbeddedDrop, EmbeddedObservation
from app.domain.drop.record import DropPhase, DropRecord, GripperUse
from app.domain.drop.supervised_inputs import GRIPPER_OPEN_US, Finish
from app.domain.flight.progress import GripperTurns, MissionProgress
from app.domain.flight.snapshot import (
    ContingencyCommand,
    DropCommand,
    VehicleSnapshot,
    contingency_command,
    finished,
    where,
    with_output,
)
from app.domain.mission import CompiledDrop, MavCmd
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.state import AIRBORNE, FlightMode, VehicleState

SURELY_SEEN_S: Final = 1.2
"""Delay until an item is observed as passed, in vehicle time: MISSION_CURRENT is sent at 1 Hz."""
LONGEST_PAUSE_S: Final = 1.0
"""Observations further apart, or positions older than this, are a gap in which anything may have happened."""


@dataclass(frozen=True, slots=True)
class EmbeddedRelease:
    """A drop that is a mission item: only observed.

    `seen_since_s`: since when the vehicle has been observed without a gap; math.inf for a flight that Waydrop did not
    observe from its start, so that the item may have passed unobserved. `in_mission_s`: when the mission was last seen
    to have the vehicle; `opens_s`: since when the newest output is at release. `place` is the vehicle's position at the
    first sign of the release.
    """

    compiled: CompiledDrop
    record: DropRecord
    on_failure: str
    gripper: GripperTurns
    seen_since_s: float = -math.inf
    drop: EmbeddedDrop = field(default_factory=EmbeddedDrop)
    state: VehicleState = field(default_factory=VehicleState)
    observed_at_s: float | None = None
    in_mission_s: float = -math.inf
    opens_s: float | None = None
    place: Mapping[str, object] | None = None

    @property
    def is_over(self) -> bool:
        return self.record.phase is DropPhase.DONE

    @property
    def is_active(self) -> bool:
        return False

    @property
    def is_busy(self) -> bool:
        return self.drop.passed_at_s is not None and not self.is_over

    def observe(
        self, seen: VehicleSnapshot, progress: MissionProgress
    ) -> tuple[EmbeddedRelease, tuple[DropCommand, ...]]:
        if self.is_over:
            return self, ()
        state = seen.state
        has_gripper = self.compiled.command is MavCmd.DO_GRIPPER
        after = self._watched(seen)
        at_item = self.gripper.is_at_item(progress) and after._is_in_mission(seen)
        flies = state.armed is True and state.landed in AIRBORNE
        drop = self.drop.saw(
            EmbeddedObservation(
                now_s=seen.now_s,
                connected=state.connected,
                passed=self.gripper.has_passed(progress),
                settled=self.gripper.has_settled(progress),
                output_us=state.gripper_output_us if has_gripper else None,
                output_age_s=state.gripper_output_age_s if has_gripper else None,
                at_item=at_item,
                earlier_passed=self.gripper.has_earlier_passed(progress),
                is_loaded=flies and (seen.carries_other or self.gripper.is_loaded(progress)),
                regrabbed=self.gripper.is_regrabbed(progress),
                reopened=self.gripper.is_reopened(progress),
                has_output=state.has_gripper_output if has_gripper else None,
                has_gripper=has_gripper,
            )
        )
        record = self.record.model_copy(update={"gripper_used_by": drop.used_by})
        record = with_output(record, self.compiled, state)
        is_its_own = drop.was_closed and at_item
        after = replace(after, drop=drop, state=state, record=record)
        after = after._placed(seen, has_sign=after.opens_s is not None and is_its_own)
        if drop.finish is None:
            return after, ()
        after = after._finished(seen, drop.finish, has_gripper=has_gripper)
        failure: ContingencyCommand | None = contingency_command(after.record, self.on_failure, seen)
        return after, (failure,) if failure else ()

    def _watched(self, seen: VehicleSnapshot) -> EmbeddedRelease:
        state = seen.state
        in_mission = state.mode in (FlightMode.MISSION, None) and not seen.carries_other
        opens = self.compiled.command is MavCmd.DO_GRIPPER and state.gripper_output_newest_us == GRIPPER_OPEN_US
        since_s = seen.now_s if self.opens_s is None else self.opens_s
        return replace(
            self,
            in_mission_s=seen.now_s if in_mission else self.in_mission_s,
            opens_s=since_s if opens else None,
        )

    def _is_in_mission(self, seen: VehicleSnapshot) -> bool:
        """Whether the mission has the vehicle, or had it as the output began to move: the mode may change before the
        new output counts.
        """
        since_s = seen.now_s if self.opens_s is None else self.opens_s
        return since_s <= self.in_mission_s + OUTPUT_LAG_S

    def gripper_used(self, by: GripperUse, progress: MissionProgress) -> EmbeddedRelease:
        """See SupervisedRelease."""
        if self.gripper.is_reloaded(progress) or self.compiled.command is not MavCmd.DO_GRIPPER:
            return self
        record = self.record.model_copy(update={"gripper_used_by": by})
        return replace(self, drop=replace(self.drop, used_by=by), record=record)

    def left_unseen(self, *, was_away: bool) -> EmbeddedRelease:
        """The flight, or its mission, ends unobserved: after a gap (`was_away`), or before its last item is told."""
        may_have_passed = self.drop.may_have_passed or was_away or self.drop.was_at_item
        return replace(self, drop=replace(self.drop, may_have_passed=may_have_passed))

    def ended(self, reason: Reason, now_s: float) -> EmbeddedRelease:
        drop = self.drop.ended(reason)
        if drop.finish is None or self.is_over:
            return replace(self, drop=drop)
        return replace(
            self, drop=drop, record=with_output(finished(self.record, drop.finish), self.compiled, self.state)
        )

    def _placed(self, seen: VehicleSnapshot, *, has_sign: bool) -> EmbeddedRelease:
        """Note the vehicle's position at the first sign of the release; none if that sign may be old.

        A sign that nothing confirms is forgotten.
        """
        age_s = seen.state.position_age_s
        pause_s = 0.0 if self.observed_at_s is None else seen.now_s - self.observed_at_s
        since_s = self.seen_since_s
        if pause_s > LONGEST_PAUSE_S or age_s is None or age_s > LONGEST_PAUSE_S or since_s == math.inf:
            since_s = seen.now_s
        after = replace(self, observed_at_s=seen.now_s, seen_since_s=since_s)
        is_sure = self.drop.passed_at_s is not None or self.drop.finish is not None
        if not (is_sure or has_sign):
            return replace(after, place=None)
        place = self.place
        if place is None:
            surely_s = SURELY_SEEN_S / max(seen.clock_rate, 1.0)
            place = where(seen, self.compiled) if seen.now_s - since_s >= surely_s else {}
        record = after.record.model_copy(update=place) if is_sure else after.record
        return replace(after, place=place, record=record)

    def _finished(self, seen: VehicleSnapshot, finish: Finish, *, has_gripper: bool) -> EmbeddedRelease:
        output_us, age_s = seen.state.gripper_output_us, seen.state.gripper_output_age_s
        changes = (
            {"output_us": output_us, "output_at": seen.time_s - age_s} if has_gripper and age_s is not None else {}
        )
        if not self.place:
            finish = replace(finish, reason=Reason.of(ReasonCode.ITEM_UNSEEN_PLACE, finish.reason))
        record = finished(self.record.model_copy(update=changes), finish)
        return replace(self, record=with_output(record, self.compiled, seen.state))
