"""Feeds a flight: observations, requests and answers go in; events are recorded, commands are handed on."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence

from app.domain.drop.consent import Answer, ConsentRecord, is_new_answer
from app.domain.errors import ConsentNotAskedError, ConsentTooLateError, NotFoundError
from app.domain.flight.flight import Flight
from app.domain.flight.inputs import (
    CommandPending,
    ConsentAnswered,
    FactReceived,
    FlightCommand,
    FlightFact,
    FlightInput,
    GripperUsed,
    Observation,
    Observed,
    RecordEvent,
    StateReached,
)
from app.domain.flight.snapshot import VehicleSnapshot
from app.domain.flight.step import step
from app.domain.flight.supervised_release import SupervisedRelease
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.reasons import Reason
from app.domain.run.run import Run, RunAction, RunState
from app.domain.vehicle.facts import LinkFact
from app.services.clock import Clock
from app.services.runs.recorder import FlightInputLog, RunRecorder
from app.services.targets import Targets


def _drop_commands(_: Sequence[FlightCommand]) -> None:
    pass


class FlightMonitor:
    """Holds the state of the flight, and alone changes it. It sends no commands itself."""

    def __init__(
        self,
        link: VehicleLink,
        flight: Flight,
        recorder: RunRecorder,
        clock: Clock,
        targets: Targets,
        input_log: FlightInputLog,
    ) -> None:
        self._link = link
        self.flight = flight
        self._recorder = recorder
        self._clock = clock
        self._targets = targets
        self._input_log = input_log
        self._carry_out: Callable[[Sequence[FlightCommand]], None] = _drop_commands

    @property
    def run(self) -> Run:
        """The current run, possibly not stored yet."""
        return self.flight.run

    def hand_commands_to(self, carry_out: Callable[[Sequence[FlightCommand]], None]) -> None:
        """`carry_out` is called with the commands of each step from now on."""
        self._carry_out = carry_out

    def observation(self) -> Observation:
        """The vehicle at this moment."""
        targets = self._targets.fixes(self.flight.segment.feeds)
        return Observation(self._link.state(), self._clock.monotonic(), self._clock.now(), targets)

    def snapshot(self) -> VehicleSnapshot:
        """The same, with the flight's knowledge of it."""
        return self.flight.snapshot(self.observation())

    def feed(self, given: FlightInput) -> None:
        """Process one input. Events wait for the recorder's next flush; commands are passed on.

        Raises:
            WrongStateError: the run cannot reach the state of the input.
        """
        self.flight, effects = step(self.flight, given)
        self._input_log.append(given, effects)
        self._recorder.update(
            self.flight.run, [effect.payload for effect in effects if isinstance(effect, RecordEvent)]
        )
        if commands := [effect for effect in effects if not isinstance(effect, RecordEvent)]:
            self._carry_out(commands)

    def reach(self, state: RunState, reason: Reason | None = None) -> None:
        """A state before the flight, or its beginning. Raises WrongStateError."""
        self.feed(StateReached(self.observation(), state, reason))

    def receive(self, fact: LinkFact) -> None:
        if isinstance(fact, FlightFact):
            self.feed(FactReceived(self.observation(), fact))

    def poll(self) -> None:
        """Observe the vehicle once."""
        self.feed(Observed(self.observation()))

    async def store_inputs(self, *, all_of_them: bool = False) -> None:
        await self._input_log.store(all_of_them=all_of_them)

    def supervised(self, plan_item_id: str, segment: int) -> SupervisedRelease | None:
        """A drop that Waydrop commands, as it is now; None once the plan was changed."""
        found = self.flight.find(plan_item_id, segment)
        return found if isinstance(found, SupervisedRelease) else None

    @contextlib.contextmanager
    def commanding(self, action: RunAction) -> Iterator[None]:
        """While this command is pending, modes in transition are not attributed to others."""
        self.feed(CommandPending(self.observation(), action))
        try:
            yield
        finally:
            self.feed(CommandPending(self.observation(), None))


class GripperUses:
    """Tells one flight who uses the gripper of its vehicle."""

    def __init__(self, monitor: FlightMonitor, recorder: RunRecorder) -> None:
        self._monitor = monitor
        self._recorder = recorder

    async def begin(self) -> None:
        """A task of offboard control is about to use it; stored when this returns. Raises StorageError."""
        self._monitor.feed(GripperUsed(self._monitor.observation()))
        await self._recorder.flush()


class Consents:
    """Receives the answers of one flight. It sends nothing: the drop acts at its next observation, with new checks."""

    def __init__(self, monitor: FlightMonitor, recorder: RunRecorder) -> None:
        self._monitor = monitor
        self._recorder = recorder

    async def answer(self, plan_item_id: str, answer: Answer, actor: str) -> Run:
        """Count an answer, or find that the same one counted already; stored when this returns.

        Raises:
            NotFoundError, ConsentNotAskedError, ConsentTooLateError, ConsentAnsweredError.
            StorageError: it counts, and is stored later; no release is sent before that.
        """
        refuse_unknown(self._monitor.run, plan_item_id)
        consent = self._consent(plan_item_id)
        if is_new_answer(consent, answer):
            self._monitor.feed(ConsentAnswered(self._monitor.observation(), plan_item_id, answer, actor))
            if self._consent(plan_item_id) == consent:
                raise ConsentTooLateError("the time to answer has expired, which counts as a refusal")
        return await self._recorder.flush()

    def _consent(self, plan_item_id: str) -> ConsentRecord | None:
        release = self._monitor.flight.segment.find(plan_item_id)
        return release.record.consent if isinstance(release, SupervisedRelease) else None


def without_flight(run: Run, plan_item_id: str, answer: Answer) -> Run:
    """The same for a run that nobody follows now: no answer can count any more, but one may have counted.

    Raises:
        NotFoundError, ConsentNotAskedError, ConsentTooLateError, ConsentAnsweredError.
    """
    refuse_unknown(run, plan_item_id)
    if is_new_answer(run.drop(plan_item_id).consent, answer):
        raise ConsentNotAskedError(
            "Waydrop restarted and has not found the vehicle yet: the consent request is withdrawn"
        )
    return run


def refuse_unknown(run: Run, plan_item_id: str) -> None:
    """Raises NotFoundError if the run has no such drop."""
    if all(drop.plan_item_id != plan_item_id for drop in run.drops):
        raise NotFoundError(f"run {run.id} has no drop {plan_item_id!r}", hint="get the run to see its drops")
