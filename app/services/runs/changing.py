"""Changes the mission of a vehicle in flight: checked first, then the rest of the changed plan is sent and followed."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection
from contextlib import aclosing, suppress
from dataclasses import dataclass, replace

from app.domain.errors import (
    ChangeUnderWayError,
    ConflictError,
    PlanRejectedError,
    StorageError,
    UploadRefusedError,
    VehicleRefusedError,
    WaydropError,
)
from app.domain.events.run import CommandOutcome, RunAck, RunCommand, RunCommandName
from app.domain.flight.inputs import (
    ChangeArrived,
    ChangeBegun,
    ChangeRefused,
    ChangeTransferEnded,
    ChangeWithdrawn,
    PendingChange,
)
from app.domain.flight.recovery import RECORDED_VISITS
from app.domain.flight.segment import concluded_drops
from app.domain.mission import Mission, mission_hash
from app.domain.plan import Plan
from app.domain.plan.compiler import compile_plan
from app.domain.plan.intercept import approach_speeds_m_s
from app.domain.ports.stores import AnswerTo, StoredAnswer
from app.domain.ports.threads import InThread
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.prediction import CALM, Timeline, Wind
from app.domain.rules import check_plan, checked
from app.domain.run.mission_change import ChangeTerms
from app.domain.run.remaining_mission import Flown, RemainingMission, asked_speed_before, continued, in_whole_plan
from app.domain.run.run import HOLDS, PlanChange, Run
from app.domain.validation.finding import Finding, Severity
from app.domain.vehicle.state import FlightMode, VehicleProfile, carried_in_flight
from app.services.clock import Clock
from app.services.plans import NewPlan
from app.services.runs.gates import FactsRead, refuse_fast_clock
from app.services.runs.monitor import FlightMonitor
from app.services.runs.recorder import RunRecorder
from app.services.runs.settings import RunSettings

_OF_THE_REST = ("battery.", "payload.")


@dataclass(frozen=True, slots=True)
class ChangeRequest:
    """The plan to fly on with. `new`: it is stored nowhere yet. `answer`: stored with the record that it is sent."""

    plan_id: str
    plan_hash: str
    plan: Plan
    new: NewPlan | None = None
    answer: AnswerTo[Run] | None = None


class MissionChanger:
    """One flight's changes, one at a time. A command that a person gives meanwhile breaks a change off."""

    def __init__(
        self,
        link: VehicleLink,
        facts: FactsRead,
        recorder: RunRecorder,
        monitor: FlightMonitor,
        settings: RunSettings,
        clock: Clock,
        in_thread: InThread,
    ) -> None:
        self._link = link
        self._in_thread = in_thread
        self._facts = facts
        self._recorder = recorder
        self._monitor = monitor
        self._settings = settings
        self._clock = clock
        self._turn = asyncio.Lock()
        self._sending: asyncio.Task[None] | None = None
        self._is_sent = False
        """Whether the upload in progress, or the last one, may have sent an item."""
        self._orders = 0
        """The number of commands so far: one during the preparation of a change must abort it too."""

    @property
    def is_open(self) -> bool:
        """Whether a change is in progress, or its arrival is unknown."""
        return self._turn.locked() or self._monitor.flight.is_changing

    async def change(
        self, wanted: ChangeRequest, continue_at: str | None, actor: str, needed: Collection[str] = ()
    ) -> None:
        """Change the mission without a pause; None continues with the current item. Stored when this returns.

        A new plan is stored in one step with the record that it is being sent. `needed` are items that must be among
        the remaining ones.

        Raises:
            WrongStateError, DropInProgressError, HoldRequiredError, ConflictError: it cannot be changed now.
            PlanRejectedError: nothing was sent; the findings point into the changed plan.
            ChangeUnderWayError: another change is in progress, or a command aborted this one.
            LinkError: its arrival may be unknown; then the run has it as `changing` until it is known.

        Each error has `may_be_done` if the mission may be on board in spite of it.
        """
        if self._turn.locked() or (self.is_open and self._monitor.run.mission_id is not None):
            raise ChangeUnderWayError("another change is in progress", hint="wait until its result is known")
        async with self._turn:
            orders = self._orders
            self._refuse_unfit()
            facts = await self._facts(fresh=True)
            pending = await self._prepare(wanted, facts, continue_at, actor, needed)
            back = await self._way_back(facts, actor)
            self._refuse_broken_off(orders)  # that took its time
            self._refuse_unfit()
            if wanted.new is not None:
                self._recorder.attach_plan(wanted.new)
            if pending.is_same and pending.follows:
                await self._adopt(pending, orders, wanted.answer)
                return
            try:
                await self._send(pending, orders, self._refuse_unfit, wanted.answer)
            except VehicleRefusedError:
                if back is not None:
                    await self._restore(pending, back)
                raise

    async def _way_back(self, facts: VehicleProfile, actor: str) -> PendingChange | None:
        """The remainder of the current plan; None if it is undefined, in the middle of a loop."""
        undeclared = replace(facts, performance=None)  # it flies that already, whatever its battery has left
        try:
            run = self._monitor.run
            flown = ChangeRequest(run.plan_id, run.plan_hash, self._monitor.flight.segment.plan)
            return await self._prepare(flown, undeclared, None, actor, ())
        except PlanRejectedError:
            return None

    def break_off(self) -> None:
        """Abort a change in progress: until its last item has arrived, the vehicle flies the previous mission."""
        self._orders += 1
        if self._sending is not None:
            self._sending.cancel()

    def _refuse_broken_off(self, orders: int) -> None:
        if self._orders != orders:
            raise _broken_off()

    def _terms(self) -> ChangeTerms:
        flight = self._monitor.flight
        if flight.mission_done:
            raise ConflictError("the mission is complete", hint="create another run")
        return ChangeTerms(
            run=self._monitor.run,
            plan=flight.segment.plan,
            mission=flight.segment.mission,
            state=self._link.state(),
            current=flight.progress.current,
            drop_is_busy=flight.drop_is_busy,
            item_is_fresh=flight.current_item_is_fresh(self._clock.monotonic()),
        )

    async def _prepare(
        self,
        new: ChangeRequest,
        facts: VehicleProfile,
        continue_at: str | None,
        actor: str,
        needed: Collection[str],
    ) -> PendingChange:
        plan, run, now = new.plan, self._monitor.run, self._terms().in_flight()
        flown = Flown(self._monitor.flight.segment.plan, run.flown_item_ids, run.item_id, concluded_drops(run.drops))
        rest = continued(flown, plan, continue_at, carried_in_flight(flown.plan.vehicle_type, now), needed)
        wanted = continue_at or run.item_id or rest.begins_at
        speed_m_s = asked_speed_before(plan, wanted, carried_in_flight(plan.vehicle_type, now))
        began = now.model_copy(update={"asked_speed_m_s": speed_m_s})
        in_flight, wind = replace(facts, in_flight=began), run.wind or CALM
        findings, timeline = await self._in_thread(_checked, plan, rest, in_flight, wind)
        if any(finding.severity is Severity.ERROR for finding in findings):
            raise PlanRejectedError(
                "the vehicle cannot continue with this plan",
                hint="correct the findings and create a new plan; the vehicle continues the current mission",
                findings=[finding.model_dump(mode="json") for finding in findings],
            )
        mission = await self._in_thread(compile_plan, rest.plan, in_flight)
        mission_id = self._link.mission_id_of(mission)
        change = PlanChange(
            plan_id=new.plan_id,
            plan_hash=new.plan_hash,
            mission_hash=mission_hash(mission),
            mission_id=mission_id,
            continue_at=wanted,
            omitted=rest.omitted,
            began=began,
            actor=actor,
            at=self._clock.now(),
        )
        follows, is_same = continue_at is None, run.mission_id == mission_id == self._link.state().mission_id
        speeds = approach_speeds_m_s(plan, facts)
        return PendingChange(change, plan, mission, timeline.first(RECORDED_VISITS), follows, is_same, speeds)

    async def _announce(
        self, pending: PendingChange, orders: int, fit: Callable[[], None], answer: AnswerTo[Run] | None
    ) -> None:
        """Stored before it is sent or followed: after a restart it must be known what may be on board. So is the
        `answer` to the request: after a kill a repetition must not change the mission again.

        Withdrawn if it cannot be stored, if more than `orders` commands were given meanwhile, or if it is not `fit` any
        more: the vehicle may be in another mode, or at an embedded drop. The speed of a simulation is checked too, and
        locked from here on.
        """
        self._monitor.feed(ChangeBegun(self._monitor.observation(), pending))
        self._recorder.record(RunCommand(command=RunCommandName.CHANGE_MISSION, change=pending.change))
        attached = None if answer is None else answer(self._monitor.run)
        if attached is not None:
            self._recorder.attach_answer(attached)
        try:
            await self._store_announced(attached)
            await refuse_fast_clock(self._link, pending.mission, self._clock)
            self._refuse_broken_off(orders)
            fit()
        except WaydropError as error:
            self._withdraw(pending, error.detail, attached)
            raise
        except asyncio.CancelledError:
            self._withdraw(pending, "it was aborted", attached)
            raise

    async def _store_announced(self, answer: StoredAnswer | None) -> None:
        """Raises StorageError: the answer is not stored, and will not be once it is detached, with no await between."""
        try:
            await self._recorder.flush()
        except StorageError:
            if answer is None or not await self._recorder.has_stored(answer):
                raise

    def _refuse_unfit(self) -> None:
        self._terms().refuse_unfit()

    async def _adopt(self, pending: PendingChange, orders: int, answer: AnswerTo[Run] | None) -> None:
        """The mission that is flown is the changed plan's too, item for item: nothing is sent. Raises as `change`."""
        await self._announce(pending, orders, self._refuse_unfit, answer)
        self._monitor.feed(ChangeArrived(self._monitor.observation()))
        self._record(CommandOutcome.DONE)
        await self._recorder.flush_or_wait()

    async def _send(
        self,
        pending: PendingChange,
        orders: int,
        fit: Callable[[], None],
        answer: AnswerTo[Run] | None = None,
    ) -> None:
        """Not sent if it cannot be announced."""
        await self._announce(pending, orders, fit, answer)
        self._is_sent = False
        self._sending = asyncio.ensure_future(self._transfer(pending.mission))
        try:
            await asyncio.wait({self._sending})
            await self._settle(pending, self._sending)
        except WaydropError as error:
            if self._is_sent and not _is_refusal(error, self._sending):
                error.mark_may_be_done()
            raise
        finally:
            self._monitor.feed(ChangeTransferEnded(self._monitor.observation()))
            self._sending.cancel()
            self._sending = None

    async def _transfer(self, mission: Mission) -> None:
        async with aclosing(self._link.replace_mission(mission)) as steps:
            async for step in steps:
                self._is_sent = True
                verified = step
        await self._link.wait_mission_ready(
            mission_id=verified.mission_id, rerun=False, timeout_s=self._settings.ready_s
        )

    async def _settle(self, pending: PendingChange, sending: asyncio.Task[None]) -> None:
        error = None if sending.cancelled() else sending.exception()
        if error is None and not sending.cancelled():
            self._monitor.feed(ChangeArrived(self._monitor.observation()))
        change = self._monitor.flight.change
        arrived = change is None or change.change != pending.change
        self._record(CommandOutcome.DONE if arrived else CommandOutcome.UNKNOWN)
        await self._recorder.flush_or_wait()
        if sending.cancelled() and not arrived:
            raise _broken_off()
        if error is not None:
            raise error
        if self._monitor.flight.skip_to > 0 and self._link.state().mode is FlightMode.MISSION:
            await self._link.set_current(
                self._monitor.flight.skip_to
            )  # otherwise it would fly back to an item that it has passed

    async def _restore(self, refused: PendingChange, back: PendingChange) -> None:
        """The vehicle received the upload and found it infeasible: it holds, and the previous mission is lost."""
        if not refused.has_arrived(self._link.state()):
            return  # it was refused before it was on board
        if self._monitor.run.commanded not in (None, *HOLDS):
            return  # it was commanded otherwise meanwhile
        self._monitor.feed(ChangeRefused(self._monitor.observation()))
        with suppress(WaydropError):
            await self._send(back, self._orders, lambda: None)  # it holds without a mission: no message can be missed

    def _withdraw(self, pending: PendingChange, why: str, answer: StoredAnswer | None) -> None:
        self._recorder.detach_plan(pending.change.plan_id)
        if answer is not None:
            self._recorder.detach_answer(answer)
        self._monitor.feed(ChangeWithdrawn(self._monitor.observation()))
        self._record(CommandOutcome.NOT_SENT, why)

    def _record(self, outcome: CommandOutcome, detail: str = "") -> None:
        self._recorder.record(RunAck(command=RunCommandName.CHANGE_MISSION, outcome=outcome, detail=detail))


def _is_refusal(error: WaydropError, sending: asyncio.Task[None]) -> bool:
    """Whether the vehicle refused what was sent, and not a command after it."""
    is_of_transfer = not sending.cancelled() and sending.exception() is error
    return is_of_transfer and isinstance(error, VehicleRefusedError | UploadRefusedError)


def _broken_off() -> ChangeUnderWayError:
    return ChangeUnderWayError("the change was aborted: another command was sent meanwhile")


def _checked(
    plan: Plan, rest: RemainingMission, in_flight: VehicleProfile, wind: Wind
) -> tuple[tuple[Finding, ...], Timeline]:
    """The findings of the whole plan, and of its remainder for a vehicle in flight, each once; and the timeline of the
    remainder.

    Charge, load and wind are current: only the remainder is checked against them.
    """
    whole = check_plan(plan, replace(in_flight, in_flight=None, performance=None))
    found = dict.fromkeys(finding for finding in whole if not finding.code.startswith(_OF_THE_REST))
    left = checked(rest.plan, in_flight, wind)
    for finding in left.findings:
        found[in_whole_plan(finding, rest.plan, plan)] = None
    return tuple(found), left.timeline
