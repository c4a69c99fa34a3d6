"""A run before its flight: it uploads, waits for its start, and starts."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import structlog

from app.domain.errors import WaydropError, WrongStateError
from app.domain.flight.inputs import RunEnded
from app.domain.flight.modes import armed_by_others
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import BEFORE_FLIGHT, NOT_STARTED, Run, RunState
from app.services.background import end_tasks
from app.services.runs.monitor import FlightMonitor
from app.services.runs.prepare import Preparation
from app.services.runs.recorder import RunRecorder

log = structlog.get_logger(__name__)


class BeforeFlight:
    """Takes one run to its flight, or to an end before it. `prepare` runs as one task; the rest comes from others.

    `forget_facts` is called where what the vehicle reported until then is no part of the flight.
    """

    def __init__(
        self,
        link: VehicleLink,
        recorder: RunRecorder,
        preparation: Preparation,
        monitor: FlightMonitor,
        forget_facts: Callable[[], None],
    ) -> None:
        self._link = link
        self._recorder = recorder
        self._preparation = preparation
        self._monitor = monitor
        self._forget_facts = forget_facts
        self._start_asked = asyncio.Event()
        self._abort_asked = asyncio.Event()
        self._start_task: asyncio.Task[None] | None = None
        self._held_back: Reason | None = None
        if recorder.run.start_requested and recorder.run.state is RunState.CREATED:
            self._start_asked.set()  # after a restart of Waydrop nothing starts automatically

    @property
    def aborts_in_flight(self) -> bool:
        """An abort was asked as the start ended: the vehicle, if nobody else took it, is to come back."""
        return self._abort_asked.is_set() and self._preparation.is_not_taken

    def ask_start(self) -> None:
        """Start an uploaded run. Raises as require_startable."""
        self.require_startable()
        self._held_back = None
        self._start_asked.set()

    def require_startable(self) -> None:
        """Raises WrongStateError unless a start may be requested, VehicleTakenError if somebody else has armed it."""
        if self._monitor.run.state not in NOT_STARTED or self._abort_asked.is_set():
            raise wrong_state(self._monitor.run, "start")
        if self._link.state().armed:
            raise armed_by_others(f"vehicle {self._monitor.run.vehicle_id}", self._link.state().mode)

    def ask_abort(self) -> None:
        """End the run before its flight; if the vehicle was armed meanwhile, see `aborts_in_flight`."""
        self._abort_asked.set()

    def withdraw(self) -> None:
        """End a run whose vehicle was not told to arm, and certainly is not any more. Idempotent.

        Raises WrongStateError: an arming was sent, or it flies.
        """
        run = self._monitor.run
        if run.is_over and run.started_at is None:
            return
        if not self._is_unarmed:
            raise wrong_state(run, "be taken off the vehicle")
        self._abort_asked.set()
        self._break_off_start()

    def hold_back(self, why: Reason) -> None:
        """End a start that was asked, if it has sent no arming yet: the run is uploaded again, with this reason."""
        if self._is_unarmed:
            self._held_back = why
            self._break_off_start()

    @property
    def _is_unarmed(self) -> bool:
        """Whether no arming was sent that may still count."""
        return self._monitor.run.state in BEFORE_FLIGHT and not self._preparation.may_fly

    def _break_off_start(self) -> None:
        """Nothing more is sent: a task that is cancelled goes on with its clean-up alone."""
        if self._start_task is not None:
            self._start_task.cancel()

    async def prepare(self, *, uploaded: bool) -> bool:
        """Upload and start; whether the vehicle flies now."""
        if not uploaded:
            upload = asyncio.create_task(self._preparation.upload(), name="upload of a run")
            if not await self._step(upload, RunState.FAILED):
                return False
        while True:
            if not await self._wait_for_start():
                await self._close(RunState.ABORTED, Reason.of(ReasonCode.ABORTED_ON_GROUND))
                return False
            self._forget_facts()  # what happened while it stood there, such as a battery swap, is no part of the flight
            by_creation = self._monitor.run.start_requested and not uploaded
            self._start_asked.clear()
            if self._held_back is not None:
                await self._close(RunState.UPLOADED, self._held_back)
                continue
            starting = self._preparation.start(self._forget_facts)
            self._start_task = asyncio.create_task(starting, name="start of a run")
            if await self._step(self._start_task, RunState.FAILED if by_creation else RunState.UPLOADED):
                if self._monitor.run.state is RunState.STARTING:
                    self._monitor.reach(RunState.FLYING)
                return True
            if self._monitor.run.is_over:
                return False

    async def _step(self, task: asyncio.Task[None], on_failure: RunState) -> bool:
        """One step before the flight, which can be broken off. A failure is the run's next state, with its reason.

        Whether it was done, or cannot be undone: a vehicle that may fly is followed.
        """
        abort = asyncio.ensure_future(self._abort_asked.wait())
        try:
            await asyncio.wait({task, abort}, return_when=asyncio.FIRST_COMPLETED)
            if not task.done():
                task.cancel()
            await asyncio.gather(task, return_exceptions=True)
            if self._preparation.may_fly and (task.cancelled() or task.exception() is not None):
                await self._follow_all_the_same(None if task.cancelled() else task.exception())
                return True
            if task.cancelled():
                if self._held_back is None or self._abort_asked.is_set():
                    await self._close(RunState.ABORTED, Reason.of(ReasonCode.ABORTED_ON_GROUND))
                else:
                    await self._close(RunState.UPLOADED, self._held_back)
                return False
            error = task.exception()
            if error is None:
                return True
            if not isinstance(error, WaydropError):
                raise error
            await self._close(on_failure, Reason.of_error(error.code, error.detail, error.hint))
            return False
        finally:
            await end_tasks(task, abort)

    async def _follow_all_the_same(self, error: BaseException | None) -> None:
        """It was armed and that could not be undone, so it may be in the air: no end of the run is claimed."""
        why = Reason.of(ReasonCode.START_ABORTED_ARMED)
        if isinstance(error, WaydropError):
            why = Reason.of(ReasonCode.START_FAILED_ARMED, error=error.code, detail=error.detail)
        elif error is not None:
            log.error("a defect ended a start", run_id=self._monitor.run.id, exc_info=error)
            why = Reason.of(ReasonCode.START_BROKE_ARMED)
        self._monitor.reach(RunState.FLYING, why)
        await self._recorder.flush_or_wait()

    async def _wait_for_start(self) -> bool:
        waits = [asyncio.ensure_future(e.wait()) for e in (self._start_asked, self._abort_asked)]
        try:
            await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
        finally:
            await end_tasks(*waits)
        return not self._abort_asked.is_set()

    async def _close(self, state: RunState, reason: Reason) -> None:
        """Before the flight: the run's state after a failure, an abort or an unstarted end."""
        if state is not RunState.UPLOADED:
            self._monitor.feed(RunEnded(self._monitor.observation(), state, reason))
        else:
            self._monitor.reach(state, reason)
        await self._recorder.flush_at_last()


def wrong_state(run: Run, action: str) -> WrongStateError:
    return WrongStateError(
        f"run {run.id} is {run.state.value}: it cannot {action} now",
        hint="get the run to see its state",
        state=run.state.value,
    )
