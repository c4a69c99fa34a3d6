"""The embedded drop: the gripper is a mission item, and the outcome is inferred from telemetry.

A ground station receives no COMMAND_ACK of a mission's gripper item, and MISSION_ITEM_REACHED is sent even without a
gripper (docs/reference/px4.md). The only usable evidence is the gripper output in SERVO_OUTPUT_RAW.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from app.domain.drop.record import Certainty, DropOutcome, GripperUse
from app.domain.drop.supervised_inputs import GRIPPER_CLOSED_US, GRIPPER_OPEN_US, LOADED_S, OUTPUT_FRESH_S, Finish
from app.domain.reasons import Reason, ReasonCode

OUTPUT_WAIT_S = 2.0
OUTPUT_LAG_S = 0.2
"""An item counts as done at most this long before the output moves (20 to 80 ms in recording 07)."""
LATE_CURRENT_S = 2.0
"""MISSION_CURRENT is sent at 1 Hz, and one may be lost."""


@dataclass(frozen=True, slots=True)
class EmbeddedObservation:
    """What is seen of an embedded drop at `now_s`.

    `passed`: its release item is passed in this visit; `settled`: so is the time that the plan gives it. The other
    fields distinguish it from other gripper items of the mission. `at_item`: the mission is at the drop's own items.
    `is_loaded`: it flies, and the mission neither opens the gripper before this drop nor closes it any more.
    `earlier_passed`: all earlier releases are passed. `regrabbed`, `reopened`: a later grab, or a later release, was
    due. `has_output`: an output is assigned to the gripper; None: unknown. `has_gripper`: false for a winch, which is
    not observable.
    """

    now_s: float
    connected: bool
    passed: bool
    output_us: int | None
    output_age_s: float | None
    at_item: bool = False
    earlier_passed: bool = True
    is_loaded: bool = False
    regrabbed: bool = False
    reopened: bool = False
    has_output: bool | None = None
    has_gripper: bool = True
    settled: bool = True

    @property
    def output(self) -> int | None:
        """The gripper output, if recent."""
        fresh = self.output_age_s is not None and self.output_age_s <= OUTPUT_FRESH_S
        return self.output_us if fresh and self.connected else None


@dataclass(frozen=True, slots=True)
class EmbeddedDrop:
    """The state of an embedded drop.

    `was_closed`: the output was last observed at grab, after all earlier releases. Only then is an opening due to this
    drop. `was_open`: it was observed at release before the mission was at this drop. `others_until_s` is when the last
    earlier release was due, `unloaded_until_s` when it was last not loaded. `strayed_at_s`: when the output opened
    while the mission was not at this drop. `used_by`: somebody opened the gripper of the loaded vehicle, or was about
    to use it; that it is closed again takes nothing back.
    `was_at_item`: the mission was at this drop once; after a reboot it says that it is at its beginning.
    `may_have_passed`: the vehicle may have flown the item unobserved.
    """

    was_closed: bool = False
    was_open: bool = False
    others_until_s: float = -math.inf
    unloaded_until_s: float = -math.inf
    strayed_at_s: float | None = None
    used_by: GripperUse | None = None
    passed_at_s: float | None = None
    was_at_item: bool = False
    may_have_passed: bool = False
    finish: Finish | None = None

    def saw(self, seen: EmbeddedObservation) -> EmbeddedDrop:
        """The state after an observation. Nothing changes after the end."""
        if self.finish is not None:
            return self
        drop = replace(self, was_at_item=True) if seen.at_item and not self.was_at_item else self
        if not seen.is_loaded:
            drop = replace(drop, unloaded_until_s=seen.now_s)
        if not seen.earlier_passed:
            drop = replace(drop, was_closed=False, others_until_s=seen.now_s)
        elif seen.output == GRIPPER_CLOSED_US and seen.now_s - (seen.output_age_s or 0.0) >= drop._alone_from_s:
            is_others = drop.strayed_at_s is not None and drop._is_surely_loaded(seen)
            used_by = drop.used_by or (GripperUse.OTHERS if is_others else None)
            drop = replace(drop, was_closed=True, was_open=False, strayed_at_s=None, used_by=used_by)
        if seen.passed and drop.passed_at_s is None:
            drop = replace(drop, passed_at_s=seen.now_s)
        if seen.output == GRIPPER_OPEN_US:
            return drop._opened(seen)
        if drop.passed_at_s is None or not seen.connected or seen.now_s - drop.passed_at_s < OUTPUT_WAIT_S:
            return drop
        if not seen.has_gripper and not seen.settled:
            return drop  # nothing shows that the winch is done: it may have its line out
        return drop._not_opened(seen)

    def ended(self, reason: Reason) -> EmbeddedDrop:
        """Finish with the run: kept if the item was certainly not passed, else unknown."""
        if self.finish is not None:
            return self
        if self.passed_at_s is None and self.strayed_at_s is not None:
            reason = Reason.of(ReasonCode.ITEM_STRAYED, reason)
            return self._over(DropOutcome.UNKNOWN, Certainty.NONE, reason)
        if self.passed_at_s is None and self.may_have_passed:
            reason = Reason.of(ReasonCode.ITEM_MAY_HAVE_PASSED, reason)
            return self._over(DropOutcome.UNKNOWN, Certainty.NONE, reason)
        if self.passed_at_s is None:
            return self._over(DropOutcome.KEPT, Certainty.INFERRED, Reason.of(ReasonCode.ITEM_NOT_REACHED, reason))
        return self._over(DropOutcome.UNKNOWN, Certainty.NONE, Reason.of(ReasonCode.ITEM_UNSEEN, reason))

    @property
    def _alone_from_s(self) -> float:
        return self.others_until_s + OUTPUT_LAG_S

    def _is_surely_loaded(self, seen: EmbeddedObservation) -> bool:
        """Whether its output is no longer where it was before the mission's last grab."""
        return seen.is_loaded and seen.now_s - (seen.output_age_s or 0.0) > self.unloaded_until_s + LOADED_S

    def _opened(self, seen: EmbeddedObservation) -> EmbeddedDrop:
        has_passed = self.passed_at_s is not None
        if self.was_closed and (seen.at_item or has_passed) and not seen.reopened:
            return self._over(DropOutcome.RELEASED, Certainty.INFERRED, Reason.of(ReasonCode.DROP_OUTPUT_RELEASED))
        if has_passed:
            was_open = self.was_open or self.strayed_at_s is not None
            code = ReasonCode.ITEM_OPEN_BEFORE if was_open else ReasonCode.ITEM_OPENING_UNSEEN
            code = ReasonCode.ITEM_LATER_RELEASE if seen.reopened else code
            return self._over(DropOutcome.UNKNOWN, Certainty.NONE, Reason.of(code))
        strayed_at_s = seen.now_s if self.strayed_at_s is None else self.strayed_at_s
        if not self.was_closed:  # since before the flight, by an earlier release, or unobserved by this item
            strays = self._is_surely_loaded(seen) and not seen.at_item
            drop = replace(self, strayed_at_s=strayed_at_s) if strays else self
            return replace(drop, was_open=self.was_open or not seen.at_item)  # undecided until the item is passed
        return replace(self, strayed_at_s=strayed_at_s, was_closed=seen.now_s - strayed_at_s < LATE_CURRENT_S)

    def _not_opened(self, seen: EmbeddedObservation) -> EmbeddedDrop:
        if seen.output == GRIPPER_CLOSED_US and not seen.regrabbed:
            return self._over(DropOutcome.KEPT, Certainty.INFERRED, Reason.of(ReasonCode.ITEM_AT_GRAB))
        code = ReasonCode.ITEM_OUTPUT_UNKNOWN
        if not seen.has_gripper:
            code = ReasonCode.ITEM_WINCH
        elif seen.has_output is False:
            code = ReasonCode.ITEM_NO_OUTPUT
        if seen.output == GRIPPER_CLOSED_US:
            code = ReasonCode.ITEM_LATER_GRAB
        return self._over(DropOutcome.UNKNOWN, Certainty.NONE, Reason.of(code))

    def _over(self, outcome: DropOutcome, certainty: Certainty, reason: Reason) -> EmbeddedDrop:
        if self.used_by is not None:
            outcome, certainty, reason = DropOutcome.UNKNOWN, Certainty.NONE, self.used_by.doubt(reason)
        return replace(self, finish=Finish(outcome, certainty, reason))
