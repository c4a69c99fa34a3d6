"""A drop that Waydrop commands itself: looks and acks go into its pure machine, orders and evidence come out."""

from __future__ import annotations

import math

from app.domain.commands import CommandAck
from app.domain.consent import Answer, ConsentState
from app.domain.drop import DropPhase, DropRecord
from app.domain.mission import CompiledDrop, MavCmd
from app.domain.plan import Target
from app.domain.progress import Progress
from app.domain.reason import Reason
from app.domain.supervised import (
    ConsentGiven,
    Divert,
    DropMachine,
    DropTerms,
    Finish,
    Observation,
    ReleaseAck,
    ReleaseTimedOut,
    ReleaseWithheld,
    Resume,
    RunEnding,
    SendRelease,
    Silence,
    TargetSight,
    step,
)
from app.domain.supervised.inputs import DropInput
from app.domain.supervised.terms import GRIPPER_OPEN_US
from app.domain.vehicle import VehicleState
from app.services.runs.consent_evidence import LEFT_HOLD, RESTARTED, answered, asked, closed, withdrawn
from app.services.runs.evidence import Look, commanded, finished, offset_m, with_output
from app.services.runs.orders import DivertOrder, Order, ReleaseOrder, ResumeOrder, failure_order


class SupervisedRelease:
    """A drop that Waydrop commands itself.

    `waited_at_s`, after a restart of ours, is the Unix time at which the journal last saw the drop still waiting: the
    hold had not begun then, and its end is counted from there.
    """

    def __init__(
        self,
        compiled: CompiledDrop,
        record: DropRecord,
        max_offset_m: float,
        on_failure: str,
        waited_at_s: float | None = None,
        target: Target | None = None,
    ) -> None:
        self.compiled = compiled
        self.record = record
        self._on_failure = on_failure
        self._target = target
        self._state = VehicleState()
        terms = DropTerms.of(compiled, max_offset_m, None if target is None else target.max_speed_m_s)
        opened = record.output_us == GRIPPER_OPEN_US
        questions = 0 if record.consent is None else record.consent.question
        self.machine = DropMachine.taken_up(terms, record.attempts, opened=opened, questions=questions)
        if record.consent is not None and record.attempts == 0 and record.phase is not DropPhase.DONE:
            self.record = record.model_copy(update={"consent": withdrawn(record.consent, RESTARTED)})
        self._waited_at_s = waited_at_s if record.phase is DropPhase.WAITING else None

    @property
    def feed(self) -> str | None:
        """The feed of its moving target; None if it has none."""
        return None if self._target is None else self._target.feed

    @property
    def is_over(self) -> bool:
        """See Release."""
        return self.machine.is_over or self.record.phase is DropPhase.DONE

    @property
    def is_active(self) -> bool:
        """See Release."""
        return not self.is_over and self.machine.phase in (DropPhase.HOLDING, DropPhase.ASKING, DropPhase.RELEASING)

    @property
    def is_asking(self) -> bool:
        """Whether an operator's consent is asked for now."""
        return self.machine.consent.state is ConsentState.ASKED

    @property
    def awaits_answer(self) -> bool:
        """Whether a release was sent whose final ack is still awaited."""
        return self.machine.in_flight is not None

    @property
    def is_busy(self) -> bool:
        """See Release."""
        return self.machine.attempts > 0 and not self.is_over

    def look(self, seen: Look, progress: Progress) -> tuple[Order, ...]:
        """See Release."""
        if self._waited_at_s is not None:
            if not seen.rate_is_measured or seen.state.boot_time_s is None:
                return ()
            waited_s = (seen.time_s - self._waited_at_s) * seen.clock_rate
            if waited_s < 0.0:
                waited_s = math.inf  # our clock was set back: how long it waited is not known, so nothing is released
            self.machine = self.machine.waiting_since(seen.state.boot_time_s - waited_s)
            self._waited_at_s = None
        return self._hear(self.observe(seen), seen)

    def observe(self, seen: Look) -> Observation:
        """What the machine is told of a look."""
        state, has_gripper = seen.state, self.compiled.command is MavCmd.DO_GRIPPER
        return Observation(
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
            gripper_output_us=state.gripper_output_us if has_gripper else None,
            gripper_output_age_s=state.gripper_output_age_s if has_gripper else None,
            target=self._sight(seen),
        )

    def _sight(self, seen: Look) -> TargetSight | None:
        fix = None if self.feed is None else seen.targets.get(self.feed)
        if fix is None:
            return None
        latitude_deg, longitude_deg = seen.state.latitude_deg, seen.state.longitude_deg
        known = latitude_deg is not None and longitude_deg is not None
        away_m = fix.distance_m(latitude_deg or 0.0, longitude_deg or 0.0) if known else None
        return TargetSight(fix.age_s, away_m, fix.report.speed_m_s)

    def acked(self, attempt: int, ack: CommandAck, seen: Look) -> tuple[Order, ...]:
        """A COMMAND_ACK of one release."""
        changes = {"acknowledged_result": ack.word}
        if ack.is_final:
            self.record = self.record.model_copy(update={**changes, "acknowledged_at": seen.time_s})
        return self._hear(ReleaseAck(seen.now_s, attempt, ack), seen)

    def timed_out(self, attempt: int, seen: Look) -> tuple[Order, ...]:
        """No final ack came."""
        return self._hear(ReleaseTimedOut(seen.now_s, attempt), seen)

    def withheld(self, attempt: int, seen: Look) -> tuple[Order, ...]:
        """The release was not sent after all."""
        if self.machine.withheld + 1 == self.machine.attempts:  # none was: the record must not say commanded
            self.record = self.record.model_copy(update={"attempts": 0, "commanded_at": None})
        return self._hear(ReleaseWithheld(seen.now_s, attempt), seen)

    def silent(self, seen: Look) -> None:
        """The vehicle is not heard: a question does not wait for it."""
        self._hear(Silence(seen.now_s), seen)

    def answer(self, answer: Answer, by: str, seen: Look) -> bool:
        """An operator's answer; whether it came in time. What follows is sent at the next look."""
        if self.record.consent is None:
            return False
        question = self.machine.consent.question if answer.question is None else answer.question
        self.machine, _ = step(self.machine, ConsentGiven(seen.now_s, question, answer.grant))
        if self.machine.consent.state is not answer.state:
            return False
        self.record = self.record.model_copy(update={"consent": answered(self.record.consent, answer, by, seen)})
        return True

    def end(self, reason: Reason, now_s: float) -> None:
        """See Release."""
        self.machine, effects = step(self.machine, RunEnding(now_s, reason))
        self._take(effects)
        if effects:
            self.record = with_output(self.record, self.compiled, self._state)
        if self.record.consent is not None and self.record.consent.state is ConsentState.ASKED:
            self.record = self.record.model_copy(update={"consent": withdrawn(self.record.consent, reason)})

    def _hear(self, heard: DropInput, seen: Look) -> tuple[Order, ...]:
        if self.machine.is_over:
            return ()
        before = self.machine.phase
        self.machine, effects = step(self.machine, heard)
        if self.machine.phase is not before and self.machine.phase is not DropPhase.DONE:
            self.record = self.record.model_copy(update={"phase": self.machine.phase})
        for effect in effects:
            if isinstance(effect, SendRelease):
                self.record = commanded(self.record, effect.attempt, seen, self.compiled)
        if any(isinstance(effect, SendRelease) for effect in effects) or self.record.commanded_at is None:
            self._note_target(seen, effects)
        self._note_output(seen)
        self._take(effects)
        self._state = seen.state
        self.record = with_output(self.record, self.compiled, seen.state)
        self._note_consent(seen)
        if diverted := next((e for e in effects if isinstance(e, Divert)), None):
            return (DivertOrder(self, diverted.seq),)  # what the plan says of a failure is for the alternate then
        if failure := failure_order(self.record, self._on_failure, seen.state):
            return (failure,)  # instead of moving on
        sends = [ReleaseOrder(self, e.attempt) for e in effects if isinstance(e, SendRelease)]
        return (*sends, *(ResumeOrder(e.seq, self.compiled.hold_seqs) for e in effects if isinstance(e, Resume)))

    def _note_target(self, seen: Look, effects: tuple[object, ...]) -> None:
        """Where the target was when a release was sent, or when the drop ended without one."""
        fix = None if self.feed is None else seen.targets.get(self.feed)
        if fix is not None and any(isinstance(effect, (SendRelease, Finish)) for effect in effects):
            evidence = fix.evidence(seen.state.latitude_deg, seen.state.longitude_deg)
            self.record = self.record.model_copy(update={"target": evidence})

    def _note_output(self, seen: Look) -> None:
        """The gripper's output after a release was commanded, with the time at which it was received.

        Until it is at release: that it is 900 again after the landing is no evidence of anything.
        """
        commanded_at, noted = self.record.commanded_at, self.record.output_us
        observed = self.observe(seen)
        output, age_s = observed.fresh_output_us, observed.gripper_output_age_s
        if commanded_at is None or age_s is None or output in (None, noted) or noted == GRIPPER_OPEN_US:
            return
        if seen.time_s - age_s >= commanded_at:
            changes = {"output_us": output, "output_at": seen.time_s - age_s}
            self.record = self.record.model_copy(update=changes)

    def _note_consent(self, seen: Look) -> None:
        """Asked, timed out, withdrawn; a grant that a release was sent with stays, whatever happens after it."""
        consent, gate = self.record.consent, self.machine.consent
        if consent is None:
            return
        if gate.state is ConsentState.ASKED and gate.question != consent.question:
            left_s = self.machine.hold.left_s(self.observe(seen), self.machine.terms)
            consent = asked(gate, seen, self.compiled, left_s)
        elif consent.state is ConsentState.ASKED or self.record.commanded_at is None:
            consent = closed(consent, gate.state, self.record.reason or LEFT_HOLD)
        self.record = self.record.model_copy(update={"consent": consent})

    def _take(self, effects: tuple[object, ...]) -> None:
        for effect in effects:
            if isinstance(effect, Finish):
                self.record = finished(self.record, effect)
