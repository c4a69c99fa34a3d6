"""All runs: created, asked, listed; one per vehicle, each in a task of its own."""

from __future__ import annotations

import asyncio
import contextlib
from collections import Counter
from collections.abc import Callable, Collection, Coroutine, Mapping, Sequence
from functools import partial

import structlog

from app.domain.drop.consent import Answer
from app.domain.errors import NotFoundError, RunNotFollowedError, StorageError, WrongStateError
from app.domain.events.run import RunAck, RunCommand, RunCreated, RunPredicted, RunTakenOver
from app.domain.flight.recovery import why_unread
from app.domain.ports.stores import ALL_RUNS, AnswerTo, FlightLog, RunFilter, RunStore
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.prediction import CALM, Wind
from app.domain.reasons import Reason
from app.domain.run.remaining_mission import refuse_continued
from app.domain.run.run import NOT_STARTED, Run, RunState, TakenOver
from app.services.background import end_tasks
from app.services.clock import Clock
from app.services.fleet import Fleet, FleetVehicle
from app.services.journal import Journal
from app.services.plans import KnownPlan, NewPlan, Plans
from app.services.runs.assembly import FlightParts, assemble
from app.services.runs.changing import ChangeRequest
from app.services.runs.flight import RunFlight
from app.services.runs.gates import (
    compiled_and_predicted,
    refuse_critical_battery,
    refuse_other_or_moving,
    refuse_unfit_plan,
    refuse_unfit_vehicle,
)
from app.services.runs.homing import HomeReturn
from app.services.runs.monitor import without_flight
from app.services.runs.recorder import new_run, new_run_id
from app.services.runs.recovery import RunRecovery
from app.services.runs.settings import RunSettings
from app.services.targets import Targets
from app.services.vehicle_commands import VehicleCommands

log = structlog.get_logger(__name__)


class Runs:
    """The registry of runs. Open runs are in memory; the others are read from the store."""

    def __init__(
        self,
        fleet: Fleet,
        plans: Plans,
        store: RunStore,
        journal: Journal,
        clock: Clock,
        flight_log: FlightLog,
        settings: RunSettings | None = None,
        targets: Targets | None = None,
    ) -> None:
        self._fleet = fleet
        self._in_thread = plans.work.of_flights
        self._plans = plans
        self._store = store
        self._clock = clock
        settings, targets = settings or RunSettings(), targets or Targets(clock)
        self._parts = FlightParts(
            journal, settings, clock, targets, plans, flight_log, fleet.may_command, self._in_thread
        )
        self._flights: dict[str, RunFlight] = {}
        self._waiting: dict[str, Run] = {}
        self._withdrawn: set[str] = set()
        self._tasks: dict[str, asyncio.Task[None]] = {}

    async def begin(self) -> None:
        """Take up what an earlier process left open. Raises StorageError."""
        for run in await self._store.list_runs(RunFilter(open_only=True), limit=1000):
            self._waiting[run.id] = run
            self._own(run.id, self._recover(run))

    async def close(self) -> None:
        """Stop looking. Runs in flight stay open: the next process takes them up. Idempotent."""
        await end_tasks(*self._tasks.values())

    async def create(
        self,
        plan: str | NewPlan,
        vehicle_id: str,
        *,
        start: bool,
        actor: str,
        wind: Wind = CALM,
        run_id: str | None = None,
        continues: str | None = None,
        answer: AnswerTo[Run] | None = None,
    ) -> Run:
        """A new run, on its way to the vehicle. Check and prediction reckon with the wind. `plan`: the id of a stored
        one, or a new one, which is stored with the run. `run_id`: a new id that the caller has stored before.
        `continues`: the run whose rest the plan is, once. `answer`: stored in the commit that creates the run.

        Raises:
            NotFoundError, VehicleBusyError, VehicleQuarantinedError, ConflictError, PlanRejectedError, LinkError,
            StorageError. With `continues` as `continuable` too.
        """
        link, vehicle = self.require_free(vehicle_id), self._fleet.vehicle(vehicle_id)
        run_id = run_id or new_run_id()
        vehicle.own(run_id)  # before the first await: a second request meets a busy vehicle
        try:
            return await self._create(run_id, plan, link, vehicle, wind, continues, answer, start=start, actor=actor)
        except BaseException:
            vehicle.release(run_id)
            raise

    async def take_over(self, run: Run, by: str, of: str, number: int | None = None) -> None:
        """Go on with a run that another gateway (`of`) followed; its plan is stored here. One that is over is only
        stored. `number` is one higher than the run's, if it is not given. Raises StorageError.
        """
        if (task := self._tasks.get(run.id)) is not None:  # of the time before the other one took it over
            task.cancel()
            await asyncio.wait({task})
        now = self._clock.now()
        taken = TakenOver(gateway=by, from_gateway=of, number=number or run.handovers + 1, at=now)
        run = run.model_copy(update={"taken_over": taken, "updated_at": now})
        journal = self._parts.journal
        told = journal.new_event(RunTakenOver(run), vehicle_id=run.vehicle_id, run_id=run.id)
        await journal.record(told, runs=(run,))
        if not run.is_over:
            self._waiting[run.id] = run
            self._own(run.id, self._recover(run))

    async def get(self, run_id: str) -> Run:
        """One run. Raises NotFoundError."""
        if run_id in self._flights:
            return self._flights[run_id].run
        run = self._waiting.get(run_id) or await self._store.get(run_id)
        if run is None:
            raise NotFoundError(f"no run {run_id!r}", hint="list the runs to see their IDs")
        return run

    async def list_runs(self, limit: int, wanted: RunFilter = ALL_RUNS) -> Sequence[Run]:
        """Newest first. Raises NotFoundError if `wanted.older_than` is no run."""
        if wanted.older_than is not None:
            await self.get(wanted.older_than)
        return await self._store.list_runs(wanted, limit=limit)

    async def open_and_recent(self, recent: int) -> Sequence[Run]:
        """All open runs and the newest ones, each once, newest first. Raises StorageError."""
        newest = await self._store.list_runs(ALL_RUNS, limit=recent)
        by_id = {run.id: run for run in (*newest, *self.open_runs())}  # of one in both, the open one is newer
        return sorted(by_id.values(), key=lambda run: run.created_at, reverse=True)

    def flight(self, run_id: str) -> RunFlight | None:
        """The flight of a run that is observed now; None if it has ended, or its vehicle is not connected yet."""
        return self._flights.get(run_id)

    def open_runs(self) -> Sequence[Run]:
        """The runs that have not ended, as stored."""
        waiting = [run for run_id, run in self._waiting.items() if run_id not in self._flights]
        return [*(flight.run for flight in self._flights.values()), *waiting]

    def open_states(self) -> Mapping[RunState, int]:
        """How many they are, by state."""
        return Counter(run.state for run in self.open_runs())

    async def start(self, run_id: str, last_check: Callable[[], None] = lambda: None) -> Run:
        """Start an uploaded run, or as soon as it is uploaded. Its plan is checked again: the battery may have changed.

        `last_check` is called last, and nothing is awaited after it: if it raises, nothing starts.

        Raises:
            NotFoundError, WrongStateError, VehicleTakenError, PlanRejectedError, LinkError, StorageError; the errors of
            `last_check`.
        """
        flight = await self._flight(run_id)
        flight.before_flight.require_startable()
        plan = await self._plans.plan(flight.run.plan_id)
        facts = await self._fleet.facts(flight.run.vehicle_id, fresh=True)
        await refuse_unfit_plan(plan, facts, flight.run.wind or CALM, self._in_thread)
        self._fleet.require_new_work()
        last_check()
        flight.before_flight.ask_start()
        return flight.run

    async def pause(self, run_id: str) -> Run:
        """Enter Hold mode. Raises NotFoundError, WrongStateError, LinkError."""
        flight = await self._flight(run_id, "hold")
        await flight.pause()
        return flight.run

    async def resume(self, run_id: str) -> Run:
        """Fly on. Raises NotFoundError, WrongStateError, ConflictError, LinkError."""
        flight = await self._flight(run_id, "resume")
        if flight.run.state is RunState.PAUSED and not flight.flight.is_in_final_return:
            refuse_critical_battery(await self._fleet.facts(flight.run.vehicle_id))
        await flight.resume()
        return flight.run

    async def return_to_launch(self, run_id: str) -> Run:
        """Return. Raises NotFoundError, WrongStateError, LinkError."""
        flight = await self._flight(run_id, "return")
        await flight.return_to_launch()
        return flight.run

    async def divert(self, run_id: str) -> Run:
        """Return to a rally point: `run.rally` says which. Raises as return_to_launch, and as RallyReturn."""
        chosen = await (await self._flight(run_id)).choose_rally()
        flight = await self._flight(run_id, "return")
        await flight.return_to_rally(chosen)
        return flight.run

    async def land(self, run_id: str) -> Run:
        """Land where it is. Raises NotFoundError, WrongStateError, LinkError."""
        flight = await self._flight(run_id, "land")
        await flight.land()
        return flight.run

    async def abort(self, run_id: str) -> Run:
        """Before take-off: cancel, also if its vehicle has not connected since the service started. In flight: return.
        One whose mission cannot be read after a restart ends with it.

        Raises NotFoundError, WrongStateError, ConflictError, LinkError.
        """
        if run_id not in self._flights and (unread := self._waiting.get(run_id)) is not None and why_unread(unread):
            await self._abort_unread(unread)
            return self._waiting.get(run_id) or await self.get(run_id)
        if run_id not in self._flights and run_id in self._waiting and self._waiting[run_id].state in NOT_STARTED:
            self.withdraw(run_id)
            return self._waiting[run_id]
        flight = await self._flight(run_id, "return")
        await flight.abort()
        return flight.run

    async def _abort_unread(self, run: Run) -> None:
        """Its vehicle comes back, if it is not on the ground. Only a recovery, which may be under way, writes it."""
        link, journal = self._fleet.vehicle(run.vehicle_id).link, self._parts.journal
        if run.state not in NOT_STARTED and link.state().armed is not False:
            told: list[RunCommand | RunAck] = []
            order = HomeReturn(link, told.append, lambda: run.home, lambda: True).order
            commands = VehicleCommands(self._fleet, journal)
            try:
                await commands.return_to_launch(run.vehicle_id, f"abort of run {run.id}", order)
            finally:
                events = [journal.new_event(one, vehicle_id=run.vehicle_id, run_id=run.id) for one in told]
                with contextlib.suppress(StorageError):  # the journal logs it
                    await journal.record(*events)
        self._withdrawn.add(run.id)

    def withdraw(self, run_id: str) -> None:
        """End an open run whose vehicle was not told to arm: from now on nothing arms it. Idempotent.

        Raises WrongStateError: it is too late, or how its start went on is not known yet.
        """
        if (flight := self._flights.get(run_id)) is not None:
            flight.before_flight.withdraw()
        elif (run := self._waiting.get(run_id)) is not None:
            if run.state not in NOT_STARTED:
                raise self._not_followed(run)
            self._withdrawn.add(run_id)

    def hold_back(self, run_id: str, why: Reason) -> None:
        """End the start of a run if it has sent no arming yet. The run waits for another start, with this reason."""
        if (flight := self._flights.get(run_id)) is not None:
            flight.before_flight.hold_back(why)

    async def change_mission(
        self,
        run_id: str,
        plan: str | NewPlan,
        continue_at: str | None,
        actor: str,
        needed: Collection[str] = (),
        answer: AnswerTo[Run] | None = None,
    ) -> Run:
        """Fly on with another plan, without a pause: from an item, or None from the one that is flown now.

        A new plan and the `answer` are stored just before it is sent. `needed` are items that must be among those left
        to fly.

        Raises:
            NotFoundError, WrongStateError, DropInProgressError, HoldRequiredError, ChangeUnderWayError, ConflictError,
            PlanRejectedError, LinkError, StorageError: see MissionChanger.
        """
        flight = await self._flight(run_id)
        self._fleet.require_new_work()
        known = await self._read(plan)
        new = plan if isinstance(plan, NewPlan) else None
        wanted = ChangeRequest(known.id, known.hash, known.plan, new, answer)
        await flight.changer.change(wanted, continue_at, actor, needed)
        return flight.run

    async def answer_consent(self, run_id: str, plan_item_id: str, answer: Answer, actor: str) -> Run:
        """An operator's answer to a drop that asks for consent: the first in time counts, the same again is no error.

        Raises:
            NotFoundError, ConsentNotAskedError, ConsentTooLateError, ConsentAnsweredError, StorageError.
        """
        flight = self._flights.get(run_id)
        if flight is None:
            return without_flight(await self.get(run_id), plan_item_id, answer)
        return await flight.consents.answer(plan_item_id, answer, actor)

    async def use_gripper(self, run_id: str) -> None:
        """A task of offboard control is about to use the gripper of the run's vehicle: stored when this returns.

        Raises NotFoundError, RunNotFollowedError, StorageError. A run that is over takes no note of it.
        """
        if (flight := self._flights.get(run_id)) is not None:
            await flight.gripper_uses.begin()
        elif not (run := await self.get(run_id)).is_over:
            raise self._not_followed(run)

    async def _create(
        self,
        run_id: str,
        plan: str | NewPlan,
        link: VehicleLink,
        vehicle: FleetVehicle,
        wind: Wind,
        continues: str | None,
        answer: AnswerTo[Run] | None,
        *,
        start: bool,
        actor: str,
    ) -> Run:
        known = await self._read(plan)
        old = None if continues is None else await self.continuable(continues)  # nobody else uses the vehicle now
        then = await self._fleet.facts(vehicle.id)
        mission, timeline = await compiled_and_predicted(known.plan, then, wind, self._in_thread)
        about = (run_id, known, vehicle.id, link, mission, wind, continues)
        run = new_run(*about, home=then.home, start=start, actor=actor, now=self._clock.now())
        facts = partial(self._fleet.facts, vehicle.id)
        made = assemble(run, known.plan, mission, link, then, facts, self._parts)
        if isinstance(plan, NewPlan):
            made.recorder.attach_plan(plan)
        made.recorder.record(RunCreated(run))
        made.recorder.record(RunPredicted(timeline))
        made.flight.begin()
        await made.recorder.flush(continues=old, answer=None if answer is None else answer(run))
        self._flights[run_id] = made.flight
        self._own(run_id, made.flight.fly())
        return run

    async def continuable(self, run_id: str) -> Run:
        """A run whose rest its vehicle may fly now. Raises NotFoundError, ConflictError as refuse_continued."""
        run = await self.get(run_id)
        if run.is_over and (ending := self._tasks.get(run_id)) is not None:
            await asyncio.wait({ending}, timeout=5.0)  # its end is stored; its last writes may not be
        refuse_continued(run, is_ending=run_id in self._flights or run_id in self._waiting)
        refuse_other_or_moving(run, self._fleet.link(run.vehicle_id))
        return run

    def require_free(self, vehicle_id: str) -> VehicleLink:
        """A vehicle that can take a run. Raises NotFoundError, VehicleQuarantinedError, ConflictError."""
        self._fleet.require_new_work()
        link, vehicle = self._fleet.link(vehicle_id), self._fleet.vehicle(vehicle_id)
        refuse_unfit_vehicle(vehicle, self._taken_by(vehicle))
        return link

    async def _read(self, plan: str | NewPlan) -> KnownPlan:
        if isinstance(plan, NewPlan):
            return KnownPlan(plan.stored.id, plan.stored.hash, plan.plan)
        return await self._plans.known(plan)

    def _taken_by(self, vehicle: FleetVehicle) -> str | None:
        """The run that has the vehicle. One whose end is stored, and so may be known, has it no longer."""
        for run in self.open_runs():
            if run.vehicle_id == vehicle.id:
                if not run.is_over:
                    return run.id
                self._fleet.release(vehicle.id, run.id)
        return vehicle.run_id

    async def _recover(self, run: Run) -> None:
        recovery = RunRecovery(self._fleet, self._parts, self._withdrawn.__contains__)
        made = await recovery.found(run, partial(self._waiting.__setitem__, run.id))
        if made is None:
            return
        self._flights[run.id] = made.flight
        if run.id in self._withdrawn:
            made.flight.before_flight.withdraw()
        self._fleet.vehicle(run.vehicle_id).own(run.id)
        await made.flight.fly(uploaded=True, in_flight=made.flight.run.state is not RunState.UPLOADED)

    def _own(self, run_id: str, work: Coroutine[None, None, None]) -> None:
        task = asyncio.create_task(work, name=f"run {run_id}")
        self._tasks[run_id] = task
        task.add_done_callback(lambda done: self._ended(run_id, done))

    def _ended(self, run_id: str, task: asyncio.Task[None]) -> None:
        self._tasks.pop(run_id, None)
        flight = self._flights.pop(run_id, None)
        waiting = self._waiting.pop(run_id, None)
        self._withdrawn.discard(run_id)
        run = flight.run if flight is not None else waiting
        if not task.cancelled() and (error := task.exception()) is not None:
            log.error("the task of a run failed; the run is recovered at the next start", run_id=run_id, exc_info=error)
            return  # the vehicle stays busy: nobody else may start over its current flight
        if run is not None:
            self._fleet.release(run.vehicle_id, run_id)

    async def _flight(self, run_id: str, action: str = "") -> RunFlight:
        if run_id not in self._flights:
            run = await self.get(run_id)
            if run_id not in self._waiting:
                raise WrongStateError(f"run {run_id} has ended: it is {run.state.value}", state=run.state.value)
            raise self._not_followed(run)
        flight = self._flights[run_id]
        if action:
            self._fleet.vehicle(flight.run.vehicle_id).commanded(action)
        return flight

    def _not_followed(self, run: Run) -> RunNotFollowedError:
        why = self._fleet.why_not_followed(run.id, run.vehicle_id, why_unread(run))
        return RunNotFollowedError(
            f"run {run.id} is not followed here: {why}",
            state=run.state.value,
            hint="command the vehicle itself: its hold, return and land are sent",
        )
