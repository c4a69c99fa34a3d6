"""The outbox of one run: its events wait until they are stored in one step with the run, which is shown then."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Coroutine, Sequence
from contextlib import suppress
from typing import Final, TypeVar

import structlog

from app.domain.errors import StorageError
from app.domain.events import AnyPayload, NewEvent
from app.domain.events.run import RunChanged, RunContinued
from app.domain.flight.flight import Flight
from app.domain.flight.inputs import FlightEffect, FlightInput
from app.domain.flight.recording import Line, Recorder, as_text, began
from app.domain.flight.segment import drop_records
from app.domain.mission import Mission, mission_hash
from app.domain.ports.stores import FlightLog, StoredAnswer
from app.domain.ports.threads import InThread
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.prediction import Wind
from app.domain.run.run import Run
from app.domain.vehicle.state import GlobalPosition
from app.services.clock import Clock
from app.services.journal import Journal
from app.services.plans import KnownPlan, NewPlan


def new_run_id() -> str:
    return f"run-{secrets.token_hex(6)}"


def new_run(
    run_id: str,
    plan: KnownPlan,
    vehicle_id: str,
    link: VehicleLink,
    mission: Mission,
    wind: Wind,
    continues: str | None,
    *,
    home: GlobalPosition | None,
    start: bool,
    actor: str,
    now: float,
) -> Run:
    """A run of this plan that is about to be uploaded, compiled with this `home`. `continues` is the run whose rest it
    flies.
    """
    identity = link.identity
    return Run(
        id=run_id,
        plan_id=plan.id,
        plan_hash=plan.hash,
        vehicle_id=vehicle_id,
        vehicle_uid=identity.uid,
        vehicle_type=identity.vehicle_type,
        firmware=None if identity.firmware is None else str(identity.firmware),
        link_security=link.state().link_security,
        mission_hash=mission_hash(mission),
        compiled_home=home,
        requested_by=actor,
        start_requested=start,
        wind=wind,
        continues=continues,
        drops=drop_records(mission),
        created_at=now,
        updated_at=now,
    )


# Keeps the inputs of one flight, so that `waydrop replay` can let today's code decide it again.


T = TypeVar("T")
log = structlog.get_logger(__name__)
KEEP_EVERY: Final = 200
"""Lines at a time: some 15 s of a flight. A kill loses those that wait."""
MOST_LINES_WAITING: Final = 5000


class FlightInputLog:
    """Lines are appended at once and stored now and then. When that fails the flight goes on without them."""

    def __init__(self, store: FlightLog, flight: Flight, in_thread: InThread = asyncio.to_thread) -> None:
        self._store = store
        self._in_thread = in_thread
        self._run_id = flight.run.id
        self._recorder = Recorder()
        self._lines: list[Line] = [began(flight)]
        self._is_cut = False

    def append(self, given: FlightInput, effects: tuple[FlightEffect, ...]) -> None:
        """One input; see Recorder. A part without a line in its middle would be decided otherwise: it ends there."""
        self._is_cut = self._is_cut or len(self._lines) >= MOST_LINES_WAITING
        if not self._is_cut:
            self._lines.append(self._recorder.line(given, effects))

    async def store(self, *, all_of_them: bool = False) -> None:
        """Store what waits, if it is enough for a part."""
        if not self._lines or (len(self._lines) < KEEP_EVERY and not all_of_them):
            return
        lines, self._lines = self._lines, []
        await _to_its_end(self._append(lines))

    async def _append(self, lines: Sequence[Line]) -> None:
        try:
            await self._store.append(self._run_id, await self._in_thread(as_text, lines))
        except StorageError as error:
            self._is_cut, self._lines = True, []
            log.warning("the inputs of a flight are no longer stored", run_id=self._run_id, error=error.detail)


async def _to_its_end(storing: Coroutine[None, None, T]) -> T:
    """Storing continues if the caller is cancelled: nobody continues before the result is known."""
    task = asyncio.ensure_future(storing)
    try:
        return await asyncio.shield(task)
    except asyncio.CancelledError:
        await asyncio.wait({task})
        if not task.cancelled():
            task.exception()
        raise


MOST_WAITING: Final = 2000


class RunRecorder:
    """The outbox of one run: events wait here until they are stored in one step with the current run.

    `run` is the newest state, `stored` the state on disk, which may be shown.

    If the disk fails, `flush` raises StorageError and everything waits for the next flush: the vehicle flies on
    meanwhile, and no release is sent, because a release is stored before it is sent. Beyond MOST_WAITING events are
    omitted; then the whole run is recorded after them, so that clients that follow the events have the stored state.
    """

    def __init__(self, run: Run, journal: Journal, clock: Clock) -> None:
        self.run = run
        self.stored = run
        """As it is on disk."""
        self._journal = journal
        self._clock = clock
        self._waiting: list[NewEvent] = []
        self._plans: list[NewPlan] = []
        self._answers: list[StoredAnswer] = []
        self._left_out = 0
        self._storing = asyncio.Lock()
        self._late: asyncio.Task[Run] | None = None

    def record(self, payload: AnyPayload) -> None:
        """An event of this run."""
        if len(self._waiting) >= MOST_WAITING:
            self._left_out += 1
            log.error(
                "run event not recorded: the journal does not accept writes",
                run_id=self.run.id,
                kind=payload.kind.value,
            )
            return
        self._waiting.append(self._event(payload))

    def update(self, run: Run, payloads: Sequence[AnyPayload]) -> None:
        """The run as the flight has it now, and the events of that step."""
        self.run = run
        for payload in payloads:
            self.record(payload)

    def attach_plan(self, plan: NewPlan) -> None:
        """A plan that this run is to fly: it is stored in one step with what waits."""
        self._plans.append(plan)

    def detach_plan(self, plan_id: str) -> None:
        """The run is not to fly this plan after all: if it still waits, it is not stored."""
        self._plans = [plan for plan in self._plans if plan.stored.id != plan_id]

    def attach_answer(self, answer: StoredAnswer) -> None:
        """The answer to a request: it is stored in one step with what waits."""
        self._answers.append(answer)

    def detach_answer(self, answer: StoredAnswer) -> None:
        """The request was refused after all: if its answer still waits, it is not stored."""
        self._answers = [one for one in self._answers if one is not answer]

    async def has_stored(self, answer: StoredAnswer) -> bool:
        """Whether this attached answer is stored. A flush that is under way in another task may store it, too."""
        async with self._storing:
            return all(one is not answer for one in self._answers)

    async def flush(self, continues: Run | None = None, answer: StoredAnswer | None = None) -> Run:
        """Store what waits. Raises StorageError; then everything waits on.

        `continues` is the run, over, whose rest this one flies: stored in the same step, so that no other ever does.
        So is the `answer` to the request for this run.
        """
        return await _to_its_end(self._store(continues, () if answer is None else (answer,)))

    async def flush_or_wait(self) -> None:
        """As `flush`, but if the disk fails, which the journal logs, everything waits for the next flush."""
        with suppress(StorageError):
            await self.flush()

    async def flush_at_last(self) -> None:
        """As `flush`, again and again until it succeeds: the end of a run is not let go before it is stored."""
        while True:
            try:
                await self.flush()
                return
            except StorageError as error:
                log.error("the end of a run waits for the journal", run_id=self.run.id, error=error.detail)
                await asyncio.sleep(1.0)

    async def flush_within(self, timeout_s: float) -> None:
        """As `flush_or_wait`, but return after `timeout_s` although the disk has not answered: storing goes on."""
        if self._late is None:
            self._late = asyncio.create_task(self._store(None), name="run recorder")
            self._late.add_done_callback(self._stored_late)
        await asyncio.wait({self._late}, timeout=timeout_s)

    def _stored_late(self, storing: asyncio.Task[Run]) -> None:
        self._late = None
        error = None if storing.cancelled() else storing.exception()
        if error is not None and not isinstance(error, StorageError):
            raise error

    async def _store(self, continues: Run | None = None, answers: Sequence[StoredAnswer] = ()) -> Run:
        async with self._storing:  # two tasks that flush at once must not store the same events twice
            if self._waiting or self._left_out or self._plans:
                plans, attached = tuple(self._plans), tuple(self._answers)
                events, run, left_out = tuple(self._waiting), self.run, self._left_out
                anew = (self._event(RunChanged(run)),) if left_out else ()
                others = () if continues is None else (self._continued(continues),)
                continued = [self._event(RunContinued(old), old.id) for old in others]
                created = [plan.created for plan in plans]
                new_plans = [plan.stored for plan in plans]
                told = (*created, *continued, *events, *anew)
                await self._journal.record(*told, runs=(*others, run), plans=new_plans, answers=(*answers, *attached))
                del self._waiting[: len(events)]
                self._plans = [plan for plan in self._plans if plan not in plans]  # some may be withdrawn meanwhile
                self._answers = [answer for answer in self._answers if answer not in attached]
                self._left_out -= left_out
                self.stored = run
            return self.stored

    def _continued(self, old: Run) -> Run:
        return old.model_copy(update={"continued_by": self.run.id, "updated_at": self._clock.now()})

    def _event(self, payload: AnyPayload, run_id: str | None = None) -> NewEvent:
        now, vehicle_id = self._clock.now(), self.run.vehicle_id
        return NewEvent.of(payload, now, vehicle_id=vehicle_id, run_id=run_id or self.run.id)
