"""One run as an actor: it uploads, starts, follows and ends; its methods are what users may command."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Final

import structlog

from app.domain.airspace.rally import RallyDestination
from app.domain.errors import (
    ChangeUnderWayError,
    ConflictError,
    LinkTimeoutError,
    StorageError,
    VehicleRefusedError,
    WaydropError,
)
from app.domain.events.run import CommandOutcome, RunAck, RunCommand, RunCommandName
from app.domain.flight.flight import Flight
from app.domain.flight.inputs import CommandFailed, CommandRequested, RunEnded
from app.domain.flight.modes import taken_meanwhile
from app.domain.flight.phase import AGREED_S, is_landing_unsure, stands_disarmed
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import BEFORE_FLIGHT, IN_FLIGHT, Run, RunAction, RunState
from app.domain.vehicle.facts import LinkFact
from app.domain.vehicle.state import FlightMode, VehicleType
from app.services.runs.before_flight import BeforeFlight, wrong_state
from app.services.runs.changing import MissionChanger
from app.services.runs.commands import FlightCommandSender
from app.services.runs.disarming import EndDisarming
from app.services.runs.diversion import RallyChoice, RallyReturn
from app.services.runs.monitor import Consents, FlightMonitor, GripperUses
from app.services.runs.prepare import Preparation
from app.services.runs.recorder import RunRecorder
from app.services.runs.settings import RunSettings
from app.services.vehicle_commands import hold_here, land_here, refuse_amid_failsafe

log = structlog.get_logger(__name__)
WAITING_FACTS: Final = 1024
LOOKED_AT_S: Final = AGREED_S + 1.0
"""A vehicle that says disarmed: maximum time until its messages agree, or it is commanded all the same."""


class RunFlight:
    """Owns one run from its creation to its end. `fly` runs as one task; actions come from other tasks."""

    def __init__(
        self,
        link: VehicleLink,
        recorder: RunRecorder,
        preparation: Preparation,
        monitor: FlightMonitor,
        sender: FlightCommandSender,
        changer: MissionChanger,
        disarming: EndDisarming,
        settings: RunSettings,
    ) -> None:
        self._link = link
        self._recorder = recorder
        self.before_flight = BeforeFlight(link, recorder, preparation, monitor, self._forget_facts)
        self._monitor = monitor
        self.sender = sender
        self.consents = Consents(monitor, recorder)
        self.gripper_uses = GripperUses(monitor, recorder)
        self.changer = changer
        self._disarming = disarming
        self._rally_return = RallyReturn(link, monitor)
        self._settings = settings
        self._facts: asyncio.Queue[LinkFact] = asyncio.Queue(WAITING_FACTS)
        self._acting = asyncio.Lock()
        self._waiting = 0

    @property
    def run(self) -> Run:
        """The run as stored."""
        return self._recorder.stored

    @property
    def flight(self) -> Flight:
        """The state of the flight, with the run as it is now, perhaps not stored yet."""
        return self._monitor.flight

    def begin(self) -> None:
        """Before `fly`, and stored before it too: the upload of a new run begins."""
        self._monitor.reach(RunState.UPLOADING)

    async def fly(self, *, uploaded: bool = False, in_flight: bool = False) -> None:
        """The whole run, or the rest of it after a restart of ours. Ends when the run is over, or by cancellation."""
        unsubscribe = self._link.subscribe(self._take)
        try:
            if in_flight or await self._reaches_flight(uploaded):
                await self._follow()
        finally:
            unsubscribe()
            await self._disarming.close()
            await self.sender.close()
            await self._monitor.store_inputs(all_of_them=True)

    async def _reaches_flight(self, uploaded: bool) -> bool:
        if not await self.before_flight.prepare(uploaded=uploaded):
            return False
        if self.before_flight.aborts_in_flight:
            with contextlib.suppress(WaydropError):  # recorded as an event; an operator can repeat it
                await self._bring_back()
        return True

    async def abort(self) -> None:
        """Before take-off: cancel and disarm. In flight: return. Raises WrongStateError, LinkError."""
        if self._monitor.run.state in BEFORE_FLIGHT:
            self.before_flight.ask_abort()
        else:
            await self._bring_back()

    async def _bring_back(self) -> None:
        if not await self._disarmed_at_start():
            await self.return_to_launch()

    async def _disarmed_at_start(self) -> bool:
        """Disarm a vehicle that was started and stands there yet: for that, Return is no way to end. False: it does
        not, or takes off, so PX4 refused it. Raises LinkError.
        """
        self.changer.break_off()
        async with self._turn():
            if self._monitor.run.state not in IN_FLIGHT or not self._stands_at_start:
                return False
            self._recorder.record(RunCommand(command=RunCommandName.DISARM))
            await self._recorder.flush_within(self._settings.stored_within_s)
            outcome, detail = CommandOutcome.FAILED, ""
            try:
                if not self._stands_at_start:  # the disk was waited for
                    outcome, detail = CommandOutcome.NOT_SENT, "it stands there no longer"
                    return False
                await self._link.disarm()
                outcome = CommandOutcome.DONE
            except VehicleRefusedError as error:
                detail = error.detail
                return False
            except WaydropError as error:
                detail = error.detail
                raise
            finally:
                self._recorder.record(RunAck(command=RunCommandName.DISARM, outcome=outcome, detail=detail))
            aborted = Reason.of(ReasonCode.ABORTED_ON_GROUND)
            self._monitor.feed(RunEnded(self._monitor.observation(), RunState.ABORTED, aborted))
        await self._recorder.flush()
        return True

    @property
    def _stands_at_start(self) -> bool:
        return self._monitor.flight.stands_at_start(self._link.state())

    async def act(
        self, action: RunAction, command: Callable[[], Awaitable[None]], rally: RallyDestination | None = None
    ) -> None:
        """A user's command in flight, before any change of the mission; `rally` is where a return goes.

        Raises WrongStateError, LinkError.
        """
        self.changer.break_off()
        async with self._turn(action):
            self._require_in_flight(action)
            self.changer.break_off()  # one may have begun while an earlier command was pending
            if action in (RunAction.RETURN, RunAction.LAND) and await self._has_landed():
                self._leave_it_landed(RunCommandName(action.value), rally)
            else:
                self._require_in_flight(action)  # its messages may have been waited for
                await self._act(action, command, rally)
        try:
            await self._recorder.flush()  # the next command does not wait for this one's record
        except StorageError as error:
            sent = f"{action.value} was carried out, but could not be recorded: {error.detail}"
            raise StorageError(sent, hint=error.hint) from error

    @contextlib.asynccontextmanager
    async def _turn(self, action: RunAction | None = None) -> AsyncIterator[None]:
        """One command at a time. While one waits, a rover does not go on stopping for its landing, for up to 10 s."""
        makes_it_give_way = action is not RunAction.LAND
        self._waiting += makes_it_give_way
        try:
            await self._acting.acquire()
        finally:
            self._waiting -= makes_it_give_way
        try:
            yield
        finally:
            self._acting.release()

    async def _act(
        self, action: RunAction, command: Callable[[], Awaitable[None]], rally: RallyDestination | None
    ) -> None:
        run, command_name = self._monitor.run, RunCommandName(action.value)
        self._monitor.feed(CommandRequested(self._monitor.observation(), action, rally))
        self._recorder.record(RunCommand(command=command_name, rally=rally))
        try:
            await self._recorder.flush_within(self._settings.stored_within_s)
            with self._monitor.commanding(action):
                await command()
        except asyncio.CancelledError:
            self._monitor.feed(self._failed(action, run))
            self._recorder.record(RunAck(command=command_name, outcome=CommandOutcome.UNKNOWN, detail="broken off"))
            raise
        except WaydropError as error:
            self._monitor.feed(self._failed(action, run))
            self._recorder.record(RunAck(command=command_name, outcome=CommandOutcome.FAILED, detail=error.detail))
            await self._recorder.flush_within(self._settings.stored_within_s)
            raise
        self._recorder.record(RunAck(command=command_name, outcome=CommandOutcome.DONE))

    def _failed(self, action: RunAction, before: Run) -> CommandFailed:
        """A rover that was not landed is left in the Hold in which it was to stop: that was Waydrop's."""
        observed, is_rover = self._monitor.observation(), self._link.identity.vehicle_type is VehicleType.ROVER
        holds = action is RunAction.LAND and is_rover and observed.state.mode is FlightMode.HOLD
        return CommandFailed(observed, action, RunAction.PAUSE if holds else before.commanded, before.rally)

    def _require_in_flight(self, action: RunAction) -> None:
        if self._monitor.run.state not in IN_FLIGHT:
            raise wrong_state(self._monitor.run, action.value)

    def _leave_it_landed(self, command: RunCommandName, rally: RallyDestination | None) -> None:
        """Return or Land is no mode for a vehicle that has landed and disarmed. It ends as it would have without."""
        if not self._monitor.run.is_over:
            self._recorder.record(RunCommand(command=command, rally=rally))
            why = "the vehicle has landed and is disarmed"
            self._recorder.record(RunAck(command=command, outcome=CommandOutcome.NOT_SENT, detail=why))

    async def _has_landed(self) -> bool:
        """One message can be forged: a vehicle that seems to have landed is watched until its messages agree, and for
        no longer. One that was not seen in the air may be taking off, and its HEARTBEAT be late.
        """
        until_s = self._monitor.observation().now_s + LOOKED_AT_S
        while self._monitor.flight.was_airborne and stands_disarmed((seen := self._monitor.observation()).state):
            if not is_landing_unsure(seen.state):
                return True
            if seen.now_s >= until_s:
                break
            await asyncio.sleep(self._settings.poll_every_s)
        return False

    async def pause(self) -> None:
        """Enter Hold mode. Raises WrongStateError, VehicleInFailsafeError, LinkError."""
        self._require_in_flight(RunAction.PAUSE)
        refuse_amid_failsafe(self._link.state())
        await self.act(RunAction.PAUSE, lambda: hold_here(self._link))

    async def resume(self) -> None:
        """Mission mode again, at the item where it was; Return mode if only the return at the mission's end is left.

        Raises WrongStateError, ChangeUnderWayError, VehicleTakenError, VehicleInFailsafeError, ConflictError,
        LinkError.
        """
        if self._monitor.run.state is not RunState.PAUSED:
            raise wrong_state(self._monitor.run, "resume")
        if self.changer.is_open:
            raise ChangeUnderWayError(
                "a mission change is in progress", hint="wait until it is known which mission is on board"
            )
        refuse_amid_failsafe(self._link.state())
        mode = self._link.state().mode

        async def fly_on() -> None:
            returns = self._monitor.flight.is_in_final_return
            now = self._link.state()  # another command was carried out first, or the disk was waited for
            if not now.connected:
                raise LinkTimeoutError(
                    "the vehicle is not heard: nothing was sent", hint="resume when it is heard again"
                )
            if self._monitor.flight.was_airborne and stands_disarmed(now):
                raise ConflictError("the vehicle is disarmed on the ground", hint="wait until the run has ended")
            if now.mode not in (mode, FlightMode.HOLD, FlightMode.RETURN if returns else FlightMode.MISSION):
                raise taken_meanwhile(now.mode)
            refuse_amid_failsafe(now)
            if returns:
                await self.sender.home_return.order()
                return
            if self._monitor.flight.names_other(now):
                raise ConflictError(
                    "another mission is on board: another client uploaded it",
                    hint="return or land; a continuation of the run flies the rest",
                )
            await self._make_current(self._monitor.flight.resumes_at)
            await self._link.start_mission()

        await self.act(RunAction.RESUME, fly_on)

    async def _make_current(self, seq: int | None) -> None:
        """PX4 carries it out as the mission is resumed. Raises LinkError."""
        if seq is None or seq == self._link.state().mission_seq:
            return
        self._recorder.record(RunCommand(command=RunCommandName.SET_CURRENT, params=(seq,)))
        try:
            await self._link.set_current(seq)
        except WaydropError as error:
            failed = CommandOutcome.FAILED
            self._recorder.record(RunAck(command=RunCommandName.SET_CURRENT, outcome=failed, detail=error.detail))
            raise
        self._recorder.record(RunAck(command=RunCommandName.SET_CURRENT, outcome=CommandOutcome.DONE))

    async def return_to_launch(self) -> None:
        """Return. Raises WrongStateError, LinkError."""
        run = self._monitor.run  # PX4 chooses as Return mode begins: commanded again, it flies on to where it flew
        goes_on = run.commanded is RunAction.RETURN and self._link.state().mode is FlightMode.RETURN
        await self.act(RunAction.RETURN, self.sender.home_return.order, run.rally if goes_on else None)

    async def return_to_rally(self, chosen: RallyChoice) -> None:
        """Return to the rally point that was chosen. Raises WrongStateError, and as RallyReturn.order."""
        await self.act(RunAction.RETURN, lambda: self._rally_return.order(chosen), chosen.destination)

    async def choose_rally(self) -> RallyChoice:
        """See RallyReturn.choose. Raises WrongStateError too."""
        if self._monitor.run.state not in IN_FLIGHT:
            raise wrong_state(self._monitor.run, "go to a rally point")
        return await self._rally_return.choose()

    async def land(self) -> None:
        """Land here and now; a rover stops first, unless another command comes meanwhile.

        Raises WrongStateError, ConflictError, LinkError.
        """
        await self.act(RunAction.LAND, lambda: land_here(self._link, lambda: self._waiting > 0))

    async def _follow(self) -> None:
        """Observe, record, command; again at each fact and each tenth of a second, until the run is over."""
        while not self._monitor.run.is_over:
            self._monitor.poll()
            self._disarming.look()
            await self._recorder.flush_or_wait()
            await self._monitor.store_inputs()
            await self._next_fact()
        await self._disarming.close()
        await self._recorder.flush_at_last()
        await self._disarming.hold()
        await self._recorder.flush_at_last()

    async def _next_fact(self) -> None:
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(self._settings.poll_every_s):
                self._monitor.receive(await self._facts.get())
        while not self._facts.empty():
            self._monitor.receive(self._facts.get_nowait())

    def _forget_facts(self) -> None:
        while not self._facts.empty():
            self._facts.get_nowait()

    def _take(self, fact: LinkFact) -> None:
        try:
            self._facts.put_nowait(fact)
        except asyncio.QueueFull:  # each observation reads the whole state, so only a repeated sign is lost
            log.warning(
                "a fact from the link was dropped: the run is behind",
                run_id=self._monitor.run.id,
                fact=type(fact).__name__,
            )
