"""A drop that Waydrop commands itself: observations and acks go into its machine, commands and evidence come out."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Final

from app.domain.drop.consent import Answer, ConsentChecks, ConsentRecord, ConsentState
from app.domain.drop.record import DropPhase, DropRecord, GripperUse
from app.domain.drop.supervised import step
from app.domain.drop.supervised_inputs import (
    GRIPPER_OPEN_US,
    ConsentGiven,
    ConsentUnanswered,
    Divert,
    DropEffect,
    DropInput,
    DropObservation,
    DropTerms,
    Finish,
    ReleaseAck,
    ReleaseTimedOut,
    ReleaseWithheld,
    Resume,
    RunEnding,
    SendRelease,
    TargetObservation,
)
from app.domain.drop.supervised_state import ConsentGate, DropMachine
from app.domain.flight.progress import MissionProgress, other_gripper_items
from app.domain.flight.snapshot import (
    DivertCommand,
    DropCommand,
    ReleaseCommand,
    ResumeCommand,
    VehicleSnapshot,
    contingency_command,
    finished,
    height_error_m,
    offset_m,
    with_command,
    with_output,
)
from app.domain.items.drop_places import Target
from app.domain.mission import CompiledDrop, MavCmd, Mission
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.commands import CommandAck, MavResult
from app.domain.vehicle.link_security import LinkSecurity
from app.domain.vehicle.state import VehicleState, mission_is_sure

_MEASURED: Final = (
    *("ground_speed_m_s", "landed", "position_age_s"),
    *("battery_percent", "gnss_satellites"),
)
LEFT_HOLD: Final = Reason.of(ReasonCode.CONSENT_LEFT_HOLD)
RESTARTED: Final = Reason.of(ReasonCode.CONSENT_RESTARTED)


def asked(gate: ConsentGate, seen: VehicleSnapshot, compiled: CompiledDrop, hold_left_s: float) -> ConsentRecord:
    """Return the record with a new request and the measurements at that time."""
    measured = {name: getattr(seen.state, name) for name in _MEASURED}
    return ConsentRecord(
        state=ConsentState.ASKED,
        question=gate.question,
        asked_at=seen.time_s,
        deadline_at=seen.time_s + gate.deadline_s - seen.now_s,
        checked=ConsentChecks(
            offset_m=offset_m(seen.state, compiled),
            relative_altitude_m=seen.relative_altitude_m,
            hold_left_s=hold_left_s,
            **measured,
        ),
    )


def closed(record: ConsentRecord, state: ConsentState | None, reason: Reason) -> ConsentRecord:
    """Return the record with an expired request."""
    if state is ConsentState.TIMED_OUT and record.state is ConsentState.ASKED:
        return record.model_copy(update={"state": state})
    return withdrawn(record, reason) if state is ConsentState.WITHDRAWN else record


def answered(record: ConsentRecord, answer: Answer, actor: str, seen: VehicleSnapshot) -> ConsentRecord:
    answered = {"state": answer.state, "answered_at": seen.time_s, "answered_by": actor, "comment": answer.comment}
    return record.model_copy(update=answered)


def withdrawn(record: ConsentRecord, reason: Reason) -> ConsentRecord:
    """Return the record with a request, or an unused grant, withdrawn."""
    if record.state not in (ConsentState.ASKED, ConsentState.GRANTED):
        return record
    return record.model_copy(update={"state": ConsentState.WITHDRAWN, "reason": reason})


ReleaseStep = tuple["SupervisedRelease", tuple[DropCommand, ...]]
"""The drop after it, and what must be sent."""


@dataclass(frozen=True, slots=True)
class SupervisedRelease:
    """A drop that Waydrop commands.

    `waited_at_s`, after a restart, is the Unix time at which the journal last showed the drop still waiting. The hold
    had not begun then, so its end is counted from there.
    """

    compiled: CompiledDrop
    record: DropRecord
    machine: DropMachine
    on_failure: str
    waited_at_s: float | None = None
    target: Target | None = None
    state: VehicleState = field(default_factory=VehicleState)

    @classmethod
    def of(
        cls,
        compiled: CompiledDrop,
        record: DropRecord,
        max_offset_m: float,
        on_failure: str,
        waited_at_s: float | None = None,
        target: Target | None = None,
        mission: Mission | None = None,
        link_was_open: bool = False,
    ) -> SupervisedRelease:
        """Return the drop of a record. Earlier consent requests are void, and so are acks of an open link."""
        is_doubtful = record.attempts > 0 and record.commanded_at is None  # of a run that was taken over
        others = None if mission is None else other_gripper_items(mission, compiled, is_doubtful=is_doubtful)
        terms = DropTerms.of(compiled, max_offset_m, None if target is None else target.max_speed_m_s, others)
        opened = record.output_us == GRIPPER_OPEN_US
        questions = 0 if record.consent is None else record.consent.question
        accepted = record.acknowledged_result is MavResult.ACCEPTED and not link_was_open
        machine = DropMachine.recovered(
            terms,
            record.attempts,
            opened=opened,
            questions=questions,
            accepted=accepted,
            used_by=record.gripper_used_by,
        )
        waited_at_s = waited_at_s if record.phase is DropPhase.WAITING else None
        if record.consent is not None and record.attempts == 0 and record.phase is not DropPhase.DONE:
            record = record.model_copy(update={"consent": withdrawn(record.consent, RESTARTED)})
        return cls(compiled, record, machine, on_failure, waited_at_s, target)

    @property
    def feed(self) -> str | None:
        """The feed of its moving target; None if it has none."""
        return None if self.target is None else self.target.feed

    @property
    def is_over(self) -> bool:
        return self.machine.is_over or self.record.phase is DropPhase.DONE

    @property
    def is_active(self) -> bool:
        return not self.is_over and self.machine.phase in (DropPhase.HOLDING, DropPhase.ASKING, DropPhase.RELEASING)

    def is_passed(self, progress: MissionProgress) -> bool:
        """Whether the mission has passed it, and it still waits. An alternate may be passed without a visit."""
        waits = self.machine.phase is DropPhase.WAITING and self.record.alternate_to is None
        return waits and progress.passed_to >= max(self.compiled.hold_seqs)

    @property
    def is_asking(self) -> bool:
        """Whether a consent request is pending."""
        return self.machine.consent.state is ConsentState.ASKED

    @property
    def awaits_answer(self) -> bool:
        """Whether the final acknowledgement of a release is pending."""
        return self.machine.in_flight is not None

    @property
    def is_busy(self) -> bool:
        return self.machine.attempts > 0 and not self.is_over

    def observe(self, seen: VehicleSnapshot, progress: MissionProgress) -> ReleaseStep:
        drop = self
        if self.waited_at_s is not None:
            if not seen.rate_is_measured or seen.state.boot_time_s is None:
                return self, ()
            waited_s = (seen.time_s - self.waited_at_s) * seen.clock_rate
            if waited_s < 0.0:
                waited_s = math.inf  # the clock was set back, so the waiting time is unknown: release nothing
            drop = replace(
                self, machine=self.machine.waiting_since(seen.state.boot_time_s - waited_s), waited_at_s=None
            )
        return drop._step(drop.observation(seen), seen)

    def observation(self, seen: VehicleSnapshot) -> DropObservation:
        """Return the observation that the drop machine gets from a snapshot."""
        state, has_gripper = seen.state, self.compiled.command is MavCmd.DO_GRIPPER
        return DropObservation(
            now_s=seen.now_s,
            connected=state.connected,
            mode=seen.mode_for_drops,
            armed=state.armed,
            in_failsafe=state.in_failsafe,
            landed=state.landed,
            mission_seq=state.mission_seq,
            boot_s=state.boot_time_s,
            clock_rate=seen.clock_rate,
            offset_m=offset_m(state, self.compiled),
            ground_speed_m_s=state.ground_speed_m_s,
            position_age_s=state.position_age_s,
            gnss_fix=state.gnss_fix,
            height_error_m=height_error_m(seen, self.compiled),
            gripper_output_us=state.gripper_output_us if has_gripper else None,
            gripper_output_age_s=state.gripper_output_age_s if has_gripper else None,
            target=self._target(seen),
            mode_is_commanded=seen.mode_for_drops is not state.mode,
            mission_is_ours=not seen.carries_other,
            mission_is_sure=mission_is_sure(state),
            link_is_open=state.link_security is LinkSecurity.OPEN,
        )

    def acked(self, attempt: int, ack: CommandAck, seen: VehicleSnapshot) -> ReleaseStep:
        drop = self
        if ack.is_final:
            changes: dict[str, object] = {"acknowledged_result": ack.result, "acknowledged_at": seen.time_s}
            drop = self._recorded(changes)
        return drop._step(ReleaseAck(seen.now_s, attempt, ack), seen)

    def timed_out(self, attempt: int, seen: VehicleSnapshot) -> ReleaseStep:
        """No final acknowledgement was received."""
        return self._step(ReleaseTimedOut(seen.now_s, attempt), seen)

    def withheld(self, attempt: int, seen: VehicleSnapshot) -> ReleaseStep:
        """The release was not sent after all."""
        none_was_sent = self.machine.withheld + 1 == self.machine.attempts
        drop = self._recorded({"attempts": 0, "commanded_at": None}) if none_was_sent else self
        return drop._step(ReleaseWithheld(seen.now_s, attempt), seen)

    def gripper_used(self, by: GripperUse, progress: MissionProgress) -> SupervisedRelease:
        """Somebody is about to use the gripper. What the mission grabs before this drop, it carries all the same."""
        others, at = self.machine.terms.others, progress.current
        is_reloaded = (
            at is not None and not others.returns and others.grabs_before(min(self.compiled.hold_seqs), at + 1)
        )
        if is_reloaded or self.compiled.command is not MavCmd.DO_GRIPPER:
            return self
        return replace(self, machine=replace(self.machine, used_by=by))._recorded({"gripper_used_by": by})

    def silent(self, seen: VehicleSnapshot) -> SupervisedRelease:
        """The vehicle is silent: a consent request does not wait for it."""
        return self._step(ConsentUnanswered(seen.now_s), seen)[0]

    def answered(self, answer: Answer, actor: str, seen: VehicleSnapshot) -> SupervisedRelease | None:
        """The drop with an operator's answer, None if it came too late. It is acted on at the next observation."""
        if self.record.consent is None:
            return None
        question = self.machine.consent.question if answer.question is None else answer.question
        machine, _ = step(self.machine, ConsentGiven(seen.now_s, question, answer.grant))
        if machine.consent.state is not answer.state:
            return None
        consent = answered(self.record.consent, answer, actor, seen)
        return replace(self, machine=machine)._recorded({"consent": consent})

    def ended(self, reason: Reason, now_s: float) -> SupervisedRelease:
        machine, effects = step(self.machine, RunEnding(now_s, reason))
        drop = replace(self, machine=machine)._taken(effects)
        if effects:
            drop = replace(drop, record=with_output(drop.record, self.compiled, self.state))
        if drop.record.consent is not None and drop.record.consent.state is ConsentState.ASKED:
            drop = drop._recorded({"consent": withdrawn(drop.record.consent, reason)})
        return drop

    def _target(self, seen: VehicleSnapshot) -> TargetObservation | None:
        fix = None if self.feed is None else seen.targets.get(self.feed)
        if fix is None:
            return None
        latitude_deg, longitude_deg = seen.state.latitude_deg, seen.state.longitude_deg
        known = latitude_deg is not None and longitude_deg is not None
        away_m = fix.distance_m(latitude_deg or 0.0, longitude_deg or 0.0) if known else None
        return TargetObservation(fix.age_s, away_m, fix.report.speed_m_s)

    def _recorded(self, changes: dict[str, object]) -> SupervisedRelease:
        return replace(self, record=self.record.model_copy(update=changes))

    def _step(self, given: DropInput, seen: VehicleSnapshot) -> ReleaseStep:
        if self.machine.is_over:
            return self, ()
        machine, effects = step(self.machine, given)
        drop = replace(self, machine=machine)
        if machine.used_by is not self.machine.used_by:
            drop = drop._recorded({"gripper_used_by": machine.used_by})
        if machine.phase is not self.machine.phase and machine.phase is not DropPhase.DONE:
            drop = drop._recorded({"phase": machine.phase})
        sends = [effect for effect in effects if isinstance(effect, SendRelease)]
        for effect in sends:
            drop = replace(drop, record=with_command(drop.record, effect.attempt, seen, self.compiled))
        if sends or drop.record.commanded_at is None:
            drop = drop._with_target(seen, effects)
        drop = drop._with_output(seen)._taken(effects)
        drop = replace(drop, state=seen.state, record=with_output(drop.record, self.compiled, seen.state))
        drop = drop._with_consent(seen)
        return drop, drop._commands(effects, seen)

    def _commands(self, effects: tuple[DropEffect, ...], seen: VehicleSnapshot) -> tuple[DropCommand, ...]:
        if diverted := next((effect for effect in effects if isinstance(effect, Divert)), None):
            # the contingency of a failure applies to the alternate then
            return (DivertCommand(self.record.plan_item_id, diverted.seq),)
        if failure := contingency_command(self.record, self.on_failure, seen):
            return (failure,)  # instead of moving on
        sends = [ReleaseCommand(self.record.plan_item_id, e.attempt) for e in effects if isinstance(e, SendRelease)]
        resumes = [ResumeCommand(self.record.plan_item_id, e.seq) for e in effects if isinstance(e, Resume)]
        return (*sends, *resumes)

    def _with_target(self, seen: VehicleSnapshot, effects: tuple[DropEffect, ...]) -> SupervisedRelease:
        """Return the target's position when a release was sent, or when the drop ended without one."""
        fix = None if self.feed is None else seen.targets.get(self.feed)
        if fix is None or not any(isinstance(effect, SendRelease | Finish) for effect in effects):
            return self
        return self._recorded({"target": fix.evidence(seen.state.latitude_deg, seen.state.longitude_deg)})

    def _with_output(self, seen: VehicleSnapshot) -> SupervisedRelease:
        """Return the gripper output after a release was commanded, with the time of receipt.

        Only until it is at release: that it is 900 again after landing has no meaning.
        """
        commanded_at, noted = self.record.commanded_at, self.record.output_us
        observed = self.observation(seen)
        output, age_s = self.machine.own_output_of(observed), observed.gripper_output_age_s
        if commanded_at is None or age_s is None or output in (None, noted) or noted == GRIPPER_OPEN_US:
            return self
        if seen.time_s - age_s < commanded_at:
            return self
        return self._recorded({"output_us": output, "output_at": seen.time_s - age_s})

    def _with_consent(self, seen: VehicleSnapshot) -> SupervisedRelease:
        """Request, expiry, withdrawal. A grant that was used for a release stays, whatever happens later."""
        consent, gate = self.record.consent, self.machine.consent
        if consent is None:
            return self
        if gate.state is ConsentState.ASKED and gate.question != consent.question:
            left_s = self.machine.hold.left_s(self.observation(seen), self.machine.terms)
            consent = asked(gate, seen, self.compiled, left_s)
        elif consent.state is ConsentState.ASKED or self.record.commanded_at is None:
            consent = closed(consent, gate.state, self.record.reason or LEFT_HOLD)
        return self._recorded({"consent": consent})

    def _taken(self, effects: tuple[DropEffect, ...]) -> SupervisedRelease:
        finish = next((effect for effect in effects if isinstance(effect, Finish)), None)
        return self if finish is None else replace(self, record=finished(self.record, finish))
