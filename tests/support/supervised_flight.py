"""A small model of a vehicle at a supervised drop: it tells the truth, the link decides what is seen of it."""

from __future__ import annotations

from dataclasses import dataclass, field

from app.domain.drop.consent import ConsentState
from app.domain.drop.supervised import step
from app.domain.drop.supervised_inputs import (
    ConsentGiven,
    Divert,
    DropEffect,
    DropInput,
    DropObservation,
    DropTerms,
    Finish,
    ReleaseAck,
    ReleaseTimedOut,
    Resume,
    RunEnding,
    SendRelease,
)
from app.domain.drop.supervised_state import DropMachine
from app.domain.mission import MavCmd
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.commands import CommandAck, MavResult
from app.domain.vehicle.state import FlightMode, GnssFix, LandedState

LANDED = Reason.of(ReasonCode.ENDED_EARLY)

TERMS = DropTerms(hold_seqs=(2,), resume_seq=3, hold_s=20.0, acceptance_radius_m=1.0, max_offset_m=2.0)
STEP_S = 0.2


@dataclass
class Flight:
    """The true vehicle and the machine that watches it. Time runs by `tick`."""

    terms: DropTerms = TERMS
    knows_output: bool = False
    link_is_open: bool = False
    now_s: float = 100.0
    mode: FlightMode = FlightMode.MISSION
    seq: int = 2
    offset_m: float = 20.0
    hold_began_s: float | None = None
    gripper_open: bool = False
    connected: bool = True
    consented: bool = False
    position_frozen_at_s: float | None = None
    gnss_fix: GnssFix | None = None
    height_error_m: float | None = None
    machine: DropMachine = field(init=False)
    effects: list[DropEffect] = field(default_factory=list)
    sends_s: list[float] = field(default_factory=list)
    sent_while_unsafe: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.machine = DropMachine.recovered(self.terms, 0)

    @property
    def moving(self) -> bool:
        return self.offset_m > 0.5

    def tick(self, seconds: float = STEP_S) -> None:
        """Let the vehicle fly, then observe it (unless the link is cut)."""
        for _ in range(max(1, round(seconds / STEP_S))):
            self.now_s += STEP_S
            self._fly()
            self.feed(self.observation())

    def held_back(self, seconds: float) -> list[DropObservation]:
        """Let the vehicle fly while nothing that it sends comes through; what will come later."""
        waiting = []
        for _ in range(round(seconds / STEP_S)):
            self.now_s += STEP_S
            self._fly()
            waiting.append(self.observation())
        return waiting

    def _fly(self) -> None:
        if self.mode is not FlightMode.MISSION:
            self.hold_began_s = None
            return
        if self.seq == self.terms.hold_seqs[0]:
            self.offset_m = max(0.2, self.offset_m - 1.0)
            if self.offset_m <= self.terms.acceptance_radius_m and self.hold_began_s is None:
                self.hold_began_s = self.now_s
            waits_s = self.terms.hold_s + self.terms.leave_s
            if self.hold_began_s is not None and self.now_s >= self.hold_began_s + waits_s:
                self.seq, self.hold_began_s = self.terms.resume_seq, None
        elif self.seq > self.terms.hold_seqs[0]:
            self.offset_m += 0.5

    def observation(self) -> DropObservation:
        seen_at_s = self.now_s if self.position_frozen_at_s is None else self.position_frozen_at_s
        return DropObservation(
            now_s=self.now_s,
            connected=self.connected,
            mode=self.mode,
            armed=True,
            in_failsafe=False,
            landed=LandedState.IN_AIR,
            mission_seq=self.seq,
            boot_s=seen_at_s,
            clock_rate=1.0,
            offset_m=self.offset_m,
            ground_speed_m_s=5.0 if self.moving else 0.05,
            position_age_s=self.now_s - seen_at_s,
            gnss_fix=self.gnss_fix,
            height_error_m=self.height_error_m,
            gripper_output_us=(1000 if self.gripper_open else 2000) if self.knows_output else None,
            gripper_output_age_s=0.05 if self.knows_output and self.connected else (9.0 if self.knows_output else None),
            link_is_open=self.link_is_open,
        )

    def feed(self, given: DropInput) -> tuple[DropEffect, ...]:
        self._follow_consent(given)
        self.machine, effects = step(self.machine, given)
        for effect in effects:
            self.effects.append(effect)
            if isinstance(effect, SendRelease):
                self._sent()
            if isinstance(effect, Resume | Divert) and self.connected:
                self.seq, self.hold_began_s = effect.seq, None
        return effects

    def _follow_consent(self, given: DropInput) -> None:
        """What an operator would say of it: a grant counts for the hold that it was asked in, if it came first."""
        if isinstance(given, ConsentGiven):
            asked = self.machine.consent
            in_time = given.question == asked.question and given.now_s < asked.deadline_s
            if asked.state is ConsentState.ASKED and in_time:
                self.consented = given.grant
        elif isinstance(given, DropObservation) and given.connected:
            away = given.mode is not FlightMode.MISSION or given.mission_seq not in self.terms.hold_seqs
            self.consented = self.consented and not away

    def _sent(self) -> None:
        self.sends_s.append(self.now_s)
        if self.mode is not FlightMode.MISSION or self.seq not in self.terms.hold_seqs or not self.connected:
            self.sent_while_unsafe.append("not holding")
        if self.moving or self.offset_m > self.terms.max_offset_m:
            self.sent_while_unsafe.append("not stopped at the point")
        if self.terms.needs_consent and not self.consented:
            self.sent_while_unsafe.append("no operator consented in this hold")
        left_s = (self.hold_began_s or -1e9) + self.terms.hold_s - self.now_s
        if left_s < self.terms.release_latency_s:
            self.sent_while_unsafe.append(f"only {left_s} s of the hold left")

    def ack(self, result: MavResult, *, attempt: int | None = None) -> tuple[DropEffect, ...]:
        number = attempt if attempt is not None else (self.machine.in_flight or self.machine.attempts)
        return self.feed(ReleaseAck(self.now_s, number, CommandAck(MavCmd.DO_GRIPPER, int(result))))

    def time_out(self) -> tuple[DropEffect, ...]:
        return self.feed(ReleaseTimedOut(self.now_s, self.machine.attempts))

    def end(self, reason: Reason = LANDED) -> tuple[DropEffect, ...]:
        return self.feed(RunEnding(self.now_s, reason))

    def until_sent(self, count: int = 1, limit_s: float = 60.0) -> None:
        """Tick until `count` releases were sent in all."""
        end_s = self.now_s + limit_s
        while len(self.sends_s) < count and self.now_s < end_s:
            self.tick()

    @property
    def finish(self) -> Finish | None:
        found = [e for e in self.effects if isinstance(e, Finish)]
        assert len(found) <= 1, "a drop must finish once"
        return found[0] if found else None

    @property
    def diverted(self) -> bool:
        return any(isinstance(e, Divert) for e in self.effects)

    @property
    def resumed(self) -> bool:
        return any(isinstance(e, Resume) for e in self.effects)
