"""Feeds a flight: observations, requests and answers go in; events are recorded, commands are sent."""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections.abc import Callable, Coroutine, Iterator, Sequence
from dataclasses import replace

from app.domain.drop.consent import Answer, ConsentRecord, is_new_answer
from app.domain.drop.supervised import still_waits
from app.domain.errors import (
    CommandExpiredError,
    ConflictError,
    ConsentNotAskedError,
    ConsentTooLateError,
    LinkError,
    NotFoundError,
    StorageError,
    WaydropError,
)
from app.domain.events.run import CommandOutcome, RunAck, RunCommand, RunCommandName, answer
from app.domain.flight.flight import Flight
from app.domain.flight.inputs import (
    Commanding,
    ConsentAnswered,
    Diverting,
    DropFailed,
    FlightFact,
    FlightInput,
    Looked,
    MovingOn,
    NotDone,
    Record,
    ReleaseAnswered,
    ReleaseNotSent,
    ReleaseUnanswered,
    Sight,
    Told,
)
from app.domain.flight.look import DivertOrder, FailureOrder, Order, ReleaseOrder, ResumeOrder, VehicleSnapshot
from app.domain.flight.step import step
from app.domain.flight.supervised_release import SupervisedRelease
from app.domain.mission import NAN
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.run.run import Asked, Run
from app.domain.vehicle.commands import CommandRequest
from app.domain.vehicle.facts import LinkFact
from app.domain.vehicle.state import FlightMode
from app.services.clock import Clock
from app.services.runs.recorder import FlightLogbook, RunRecorder
from app.services.runs.settings import RunSettings
from app.services.targets import Targets

# Feeds a flight: what is seen, asked and answered goes in, its events go to the recorder, its orders to the caller.


class FlightMonitor:
    """Holds the flight's state. It commands nothing: whoever feeds it carries out the orders."""

    def __init__(
        self,
        link: VehicleLink,
        flight: Flight,
        recorder: RunRecorder,
        clock: Clock,
        targets: Targets,
        logbook: FlightLogbook,
    ) -> None:
        self._link = link
        self._flight = flight
        self._recorder = recorder
        self._clock = clock
        self._targets = targets
        self.logbook = logbook

    @property
    def flight(self) -> Flight:
        """The flight after the last input, with the run as it is now."""
        return replace(self._flight, run=self._recorder.run)

    def sight(self) -> Sight:
        """The vehicle at this moment."""
        targets = self._targets.fixes(self._flight.leg.feeds)
        return Sight(self._link.state(), self._clock.monotonic(), self._clock.now(), targets)

    def see(self) -> VehicleSnapshot:
        """The same, with what the flight knows of it."""
        return self.flight.look(self.sight())

    def feed(self, heard: FlightInput) -> tuple[Order, ...]:
        """One input. What it records waits for the recorder's next flush; what it orders must be sent."""
        before = self.flight
        self._flight, effects = step(before, heard)
        self.logbook.note(before.run, heard, self._flight, effects)
        self._recorder.take(self._flight.run, [effect.payload for effect in effects if isinstance(effect, Record)])
        return tuple([effect for effect in effects if not isinstance(effect, Record)])

    def heard(self, fact: LinkFact) -> None:
        """A fact from the link."""
        if isinstance(fact, FlightFact):
            self.feed(Told(self.sight(), fact))

    def look(self) -> tuple[Order, ...]:
        """Look once."""
        return self.feed(Looked(self.sight()))

    def supervised(self, plan_item_id: str, leg: int) -> SupervisedRelease | None:
        """A drop that Waydrop commands, as it is now; None once the plan was changed."""
        found = self.flight.find(plan_item_id, leg)
        return found if isinstance(found, SupervisedRelease) else None

    @contextlib.contextmanager
    def commanding(self, asked: Asked) -> Iterator[None]:
        """While the vehicle is told this: modes on the way are nobody else's."""
        self.feed(Commanding(self.sight(), asked))
        try:
            yield
        finally:
            self.feed(Commanding(self.sight(), None))


# What a drop's machine ordered goes out here: stored first, looked at once more, then sent.


class OrderSender:
    """Sends releases and resumes, each in a task of its own, and hands the answers back to the drop."""

    def __init__(
        self,
        link: VehicleLink,
        recorder: RunRecorder,
        watch: FlightMonitor,
        settings: RunSettings,
        break_off: Callable[[], None],
    ) -> None:
        """`break_off` ends a change of the mission that is under way."""
        self._link = link
        self._recorder = recorder
        self._watch = watch
        self._settings = settings
        self._break_off = break_off
        self._tasks: set[asyncio.Task[None]] = set()

    def carry_out(self, orders: Sequence[Order]) -> None:
        """Begin to send."""
        leg = self._watch.flight.run.changes
        for order in orders:
            match order:
                case ReleaseOrder():
                    self._spawn(self._release(order, leg), f"release {order.plan_item_id} #{order.attempt}")
                case ResumeOrder():
                    self._spawn(self._resume_at(order.seq, order.waiting_at), f"resume at {order.seq}")
                case DivertOrder():
                    self._spawn(self._divert(order, leg), f"to the alternate of {order.plan_item_id}")
                case FailureOrder():
                    self._spawn(self._on_failure(order), f"{order.action} after {order.plan_item_id}")

    async def close(self) -> None:
        """End what is under way. A release that was sent stays recorded as commanded."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def _spawn(self, work: Coroutine[None, None, None], name: str) -> None:
        task = asyncio.create_task(work, name=name)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _on_failure(self, order: FailureOrder) -> None:
        """Do what the plan says of a failed drop. If that fails too, the mission on board goes on."""
        self._break_off()
        returns = order.action == "return"
        run, asked = self._recorder.run, Asked.CONTINGENCY if returns else Asked.PAUSE
        command = RunCommandName.RETURN if returns else RunCommandName.HOLD
        self._watch.feed(DropFailed(self._watch.sight(), asked))
        self._recorder.note(RunCommand(command=command, failed_drop_id=order.plan_item_id))
        try:
            with self._watch.commanding(asked):
                await (self._link.return_to_launch() if returns else self._link.hold())
            ack = RunAck(command=command, outcome=CommandOutcome.DONE)
        except WaydropError as error:
            ack = RunAck(command=command, outcome=CommandOutcome.FAILED, detail=error.detail)
            self._watch.feed(NotDone(self._watch.sight(), asked, run.asked, run.rally))
        self._recorder.note(ack)

    async def _release(self, order: ReleaseOrder, leg: int) -> None:
        drop = self._watch.supervised(order.plan_item_id, leg)
        if drop is None:
            return
        params = tuple(None if math.isnan(p) else p for p in drop.compiled.params)
        self._recorder.note(RunCommand(command=_name_of(drop), params=params, attempt=order.attempt))
        try:
            await self._recorder.flush()
        except StorageError:
            self._withhold(order, leg, drop)
            return
        # the disk may have taken its time: what was right when it was ordered must be right now
        now, look = self._watch.supervised(order.plan_item_id, leg), self._watch.see()
        if now is None or not now.machine.may_send(now.observe(look)):
            self._withhold(order, leg, drop)
            return
        await self._send(order, leg, now, now.machine.send_before_s(now.observe(look)))
        with contextlib.suppress(StorageError):  # it waits for the next flush
            await self._recorder.flush()

    async def _send(self, order: ReleaseOrder, leg: int, drop: SupervisedRelease, send_before_s: float) -> None:
        p1, p2, p3, p4, p5, p6, p7 = (*drop.compiled.params, *([NAN] * 7))[:7]
        request = CommandRequest(
            drop.compiled.command,
            (p1, p2, p3, p4, p5, p6, p7),
            timeout_s=self._settings.ack_s,
            attempts=1,
            in_progress_timeout_s=self._settings.gripper_s,
            send_before_s=send_before_s,
        )
        about = (leg, order.plan_item_id, order.attempt)
        try:
            async for ack in self._link.command(request):
                self._recorder.note(answer(_name_of(drop), ack, order.attempt))
                self._feed(ReleaseAnswered(self._watch.sight(), *about, ack))
        except (CommandExpiredError, ConflictError):  # nothing was sent
            self._withhold(order, leg, drop)
        except LinkError as error:
            self._note_ack(order, drop, CommandOutcome.FAILED, detail=error.detail)
            self._feed(ReleaseUnanswered(self._watch.sight(), *about))

    def _withhold(self, order: ReleaseOrder, leg: int, drop: SupervisedRelease) -> None:
        self._note_ack(order, drop, CommandOutcome.NOT_SENT, detail="its moment was over before it was recorded")
        self._feed(ReleaseNotSent(self._watch.sight(), leg, order.plan_item_id, order.attempt))

    def _note_ack(self, order: ReleaseOrder, drop: SupervisedRelease, outcome: CommandOutcome, detail: str) -> None:
        command = _name_of(drop)
        self._recorder.note(RunAck(command=command, outcome=outcome, attempt=order.attempt, detail=detail))

    def _feed(self, heard: FlightInput) -> None:
        self.carry_out(self._watch.feed(heard))

    async def _divert(self, order: DivertOrder, leg: int) -> None:
        """Send the vehicle to the alternate, once that is stored, and only if it surely waits until the last try of the
        command: one that comes later would turn it back. If it fails, the bounded hold ends by itself, and the drop at
        the alternate ends as one that was passed.
        """
        self._watch.feed(Diverting(self._watch.sight(), order.plan_item_id))
        try:
            await self._recorder.flush()
        except StorageError:
            return
        drop, look = self._watch.supervised(order.plan_item_id, leg), self._watch.see()
        if drop is not None and still_waits(drop.machine, drop.observe(look), drop.machine.terms.resume_s):
            await self._set_current(order.seq, failed_drop_id=order.plan_item_id)

    async def _resume_at(self, seq: int, waiting_at: tuple[int, ...]) -> None:
        """Move the mission on after a drop. If it fails the bounded hold ends by itself."""
        seen = self._watch.see()
        if seen.mode_for_drops is not FlightMode.MISSION or seen.state.mission_seq not in waiting_at:
            return  # a person has it, or it moved on by itself: a late command would move it back
        await self._set_current(seq)

    async def _set_current(self, seq: int, *, failed_drop_id: str | None = None) -> None:
        self._recorder.note(
            RunCommand(command=RunCommandName.SET_CURRENT, params=(seq,), failed_drop_id=failed_drop_id)
        )
        self._watch.feed(MovingOn(self._watch.sight(), 1))
        try:
            await self._link.set_current(seq)
            ack = RunAck(command=RunCommandName.SET_CURRENT, outcome=CommandOutcome.DONE)
        except WaydropError as error:
            ack = RunAck(command=RunCommandName.SET_CURRENT, outcome=CommandOutcome.FAILED, detail=error.detail)
        finally:
            self._watch.feed(MovingOn(self._watch.sight(), -1))
        self._recorder.note(ack)


def _name_of(drop: SupervisedRelease) -> RunCommandName:
    return RunCommandName(drop.compiled.command.name)


# Operators' answers to what the drops of one flight ask: the first one in time counts, and no other.


class Consents:
    """Takes the answers of one flight. It sends nothing: the drop does what follows at its next look, checked anew."""

    def __init__(self, watch: FlightMonitor, recorder: RunRecorder) -> None:
        self._watch = watch
        self._recorder = recorder

    async def answer(self, plan_item_id: str, answer: Answer, actor: str) -> Run:
        """Count an answer, or find that the same one counted already; stored when this returns.

        Raises:
            NotFoundError, ConsentNotAskedError, ConsentTooLateError, ConsentAnsweredError.
            StorageError: it counts, and is stored later; no release is sent before that.
        """
        refuse_unknown(self._recorder.run, plan_item_id)
        consent = self._consent(plan_item_id)
        if is_new_answer(consent, answer):
            self._watch.feed(ConsentAnswered(self._watch.sight(), plan_item_id, answer, actor))
            if self._consent(plan_item_id) == consent:
                raise ConsentTooLateError("the time to answer is over: that counts as a refusal")
        return await self._recorder.flush()

    def _consent(self, plan_item_id: str) -> ConsentRecord | None:
        release = self._watch.flight.leg.find(plan_item_id)
        return release.record.consent if isinstance(release, SupervisedRelease) else None


def without_flight(run: Run, plan_item_id: str, answer: Answer) -> Run:
    """The same for a run that nobody follows now: no answer can count any more, but one may have counted.

    Raises:
        NotFoundError, ConsentNotAskedError, ConsentTooLateError, ConsentAnsweredError.
    """
    refuse_unknown(run, plan_item_id)
    if is_new_answer(run.drop(plan_item_id).consent, answer):
        raise ConsentNotAskedError("Waydrop restarted and has not found the vehicle yet: what it asked does not count")
    return run


def refuse_unknown(run: Run, plan_item_id: str) -> None:
    """Raises NotFoundError if the run has no such drop."""
    if all(drop.plan_item_id != plan_item_id for drop in run.drops):
        raise NotFoundError(f"run {run.id} has no drop {plan_item_id!r}", hint="GET the run: its drops are listed")
