"""One vehicle under offboard control: feeds what happens to `domain/offboard` and carries out what that decides."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable, Sequence
from typing import Literal, TypeVar

import structlog

from app.domain.autopilot.capability import AuditedParameter
from app.domain.errors import ConflictError, LeaseLostError, OffboardNotReadyError, SetpointRefusedError, WaydropError
from app.domain.events.vehicle import OffboardChanged, OffboardLease
from app.domain.offboard import inputs
from app.domain.offboard.control_method import ControlMethod
from app.domain.offboard.inputs import ControlAction, Effect, Input, RecordLease, RecordState, StartStream
from app.domain.offboard.limits import Clamp
from app.domain.offboard.messages import SetpointMessage
from app.domain.offboard.setpoints import Setpoint
from app.domain.offboard.state import SENDING, Control, Lease, LeaseChange, OffboardState
from app.domain.offboard.step import step
from app.domain.ports.threads import InThread
from app.domain.ports.vehicle_link import Unsubscribe, VehicleLink
from app.domain.reasons import Reason, ReasonCode, describe
from app.domain.run.run import Run
from app.domain.vehicle.facts import LinkFact
from app.domain.vehicle.state import FlightMode
from app.services.clock import Clock
from app.services.fleet import Fleet, FleetVehicle
from app.services.offboard.commands import CommandQueue
from app.services.offboard.preflight import (
    ControlContext,
    PreflightReport,
    initial_context,
    preflight_report,
    refuse_nothing_to_stream,
    refuse_unready,
    refuse_unsafe_parameters,
    until_no_failsafe,
    with_fence,
)
from app.services.offboard.rate_loop import RateLoop
from app.services.offboard.settings import OffboardSettings
from app.services.offboard.stream import Author, SetpointFlow, SetpointSource
from app.services.runs import Runs
from app.services.vehicle_commands import refuse_amid_failsafe
from app.services.views import ControlMethodName, LeaseView, OffboardView

Destination = Literal["hold", "mission", "return"]
T = TypeVar("T")
_S = OffboardState
log = structlog.get_logger(__name__)


class OffboardControl:
    """All of it runs on the event loop. Nothing is sent but by a tick, and no tick sends without a lease."""

    def __init__(
        self,
        vehicle: FleetVehicle,
        fleet: Fleet,
        runs: Runs,
        clock: Clock,
        settings: OffboardSettings,
        in_thread: InThread,
    ) -> None:
        self.vehicle = vehicle
        self.settings = settings
        self.context: ControlContext | None = None
        self.setpoint_source: SetpointSource | None = None
        self._control = Control(vehicle.id, settings.lease_s)
        self._fleet = fleet
        self._runs = runs
        self._clock = clock
        self._in_thread = in_thread
        self.commands = CommandQueue(vehicle.link, clock, settings.dead_man.gone_s, self.changed)
        self._flow = SetpointFlow(settings, self._put_out)
        self._rate_loop = RateLoop(vehicle.id, clock, settings.gap_s, self._tick, self._on_gap, self._on_defect)
        self._holding: asyncio.Task[None] | None = None
        self._entering: asyncio.Task[Sequence[AuditedParameter]] | None = None
        self._leaving: asyncio.Task[None] | None = None
        self._listeners: list[Callable[[], None]] = []
        self._unsubscribe = vehicle.link.subscribe(self._link_fact_received)
        vehicle.observe(self)

    def set_setpoint_source(self, source: SetpointSource) -> None:
        """From now on the setpoints of `source` count beside the client's."""
        self.setpoint_source = source

    def commanded(self, action: str) -> None:
        self._feed(inputs.UserCommanded(action))

    # observation ----------------------------------------------------------------------------------------------

    @property
    def link(self) -> VehicleLink:
        return self.vehicle.link

    @property
    def state(self) -> OffboardState:
        """How far it is."""
        return self._control.state

    @property
    def reason(self) -> Reason | None:
        """Why it is so, or why the last lease ended."""
        return self._control.reason

    @property
    def lease(self) -> Lease | None:
        return self._control.lease

    @property
    def control_method(self) -> ControlMethod:
        """The control method of the last lease."""
        return self._control.control_method

    def subscribe(self, listener: Callable[[], None]) -> Unsubscribe:
        """Call `listener` when state or lease have changed."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener) if listener in self._listeners else None

    def changed(self) -> None:
        """Notify the listeners."""
        for listener in tuple(self._listeners):
            listener()

    def view(self) -> OffboardView:
        """How it is now."""
        now_s, control = self._clock.monotonic(), self._control
        streams = control.state in SENDING and not control.is_commanded
        sent, rate = self._flow.views(now_s) if streams else (None, None)
        return OffboardView(
            state=control.state,
            lease=None if control.lease is None else LeaseView.of(control.lease, now_s),
            reason=control.reason,
            sent=sent,
            rate=rate,
            tasks=None if self.setpoint_source is None else self.setpoint_source.report(),
            control_method=None if control.lease is None else control.control_method.value,
            command=self.commands.view(now_s),
        )

    def view_if_used(self) -> OffboardView | None:
        """For telemetry: None while there has never been a lease."""
        return None if self.state is _S.IDLE and not self.reason else self.view()

    # what clients do ------------------------------------------------------------------------------------------

    def acquire(self, holder: str, *, rate_hz: float, override: bool = False) -> Lease:
        """Acquire the lease. If it is taken over in flight, the new holder must send before the dead-man timer acts.

        Raises:
            LeaseHeldError: another client has it. VehicleQuarantinedError. OffboardNotReadyError: the type is unknown.
        """
        self._check_gap()
        self._fleet.require_new_work()
        self._fleet.link(self.vehicle.id)
        control_method = self._initial_context().control_method(self.link.state()) or ControlMethod.SETPOINTS
        expires_s = self._clock.monotonic() + self.settings.lease_s
        lease = Lease(f"lease-{secrets.token_urlsafe(16)}", self.vehicle.id, holder, expires_s)
        self._feed(inputs.AcquireLease(lease, rate_hz, control_method, override))
        return lease

    def require(self, lease_id: str) -> Lease:
        """Renew the lease. Raises LeaseLostError."""
        self._check_gap()
        self._feed(inputs.RenewLease(lease_id))
        return self.check(lease_id)

    def check(self, lease_id: str) -> Lease:
        """Look whether it is still this lease, and renew nothing. Raises LeaseLostError."""
        self._check_gap()
        return self._control.held(lease_id, self._clock.monotonic())

    def offer(self, lease_id: str, to: str | None) -> None:
        """Offer the lease to `to`; None withdraws the offer. Raises LeaseLostError."""
        self._check_gap()
        self._feed(inputs.OfferLease(lease_id, to))

    def release(self, lease_id: str, reason: Reason) -> None:
        """The holder gives the lease up, or its socket closed: Hold if the vehicle is flown. Raises LeaseLostError."""
        self.check(lease_id)
        self.give_up(LeaseChange.RELEASED, reason)

    def give_up(self, change: LeaseChange, reason: Reason) -> None:
        """End the lease, stop sending, and command Hold if the vehicle follows us. Idempotent."""
        self._feed(inputs.EndLease(change, reason, holds=True))

    def end(self, change: LeaseChange, reason: Reason) -> None:
        """End the lease and stop sending; command nothing. Idempotent."""
        self._feed(inputs.EndLease(change, reason, holds=False))

    def put(self, lease_id: str, setpoint: Setpoint) -> tuple[Clamp, ...]:
        """The newest setpoint, sent from the next tick on if the vehicle is under control. What was clamped of it.

        Raises:
            LeaseLostError; SetpointRefusedError: it is not sent, and the one before it goes on to its age.
        """
        self.require(lease_id)
        source = self.setpoint_source
        if source is not None:
            source.refuse_client_setpoint()
        clamps = self._slot(setpoint, "client")
        if source is not None:
            source.client_sent_setpoint()
        return clamps

    def steer(self, setpoint: Setpoint) -> tuple[Clamp, ...]:
        """A setpoint of the setpoint source, like the client's own, but it renews no lease: the client must do that.

        Raises LeaseLostError, SetpointRefusedError.
        """
        return self._slot(setpoint, "task")

    async def close(self) -> None:
        """The service ends: Hold for what it flies, within a bound; the vehicle's own failsafe does the rest."""
        self.give_up(LeaseChange.REVOKED, Reason.of(ReasonCode.OFFBOARD_SERVICE_STOPS))
        if self._holding is not None:
            await asyncio.wait({self._holding}, timeout=self.settings.goodbye_s)
            self._holding.cancel()
        self._unsubscribe()

    # the way in -----------------------------------------------------------------------------------------------

    async def preflight(self, *, sticks_held: bool) -> PreflightReport:
        """What `enter` would find now. Needs no lease. Raises OffboardNotReadyError (type unknown), LinkError."""
        given = self._flow.has_setpoint(self._clock.monotonic(), self.setpoint_source)
        about = (self.vehicle.id, self.link, self._initial_context(), await self._run())
        return await preflight_report(*about, sticks_held=sticks_held, has_setpoint=given)

    async def enter(
        self, lease_id: str, *, sticks_held: bool, control_method: ControlMethodName | None = None
    ) -> Sequence[AuditedParameter]:
        """Hold, one second of stream, then the mode: a stream alone could pull a vehicle out of a failsafe.

        `control_method` None: as its tasks are flown. By commands it stays in Hold, and nothing is streamed.

        Raises:
            LeaseLostError, OffboardNotReadyError, AuditFailedError, VehicleRefusedError (with the vehicle's reasons),
            LinkError.
        """
        self.require(lease_id)
        if self.state is _S.LEASED and self._entering is not None and not self._entering.done():
            raise OffboardNotReadyError("entering offboard control is already in progress")
        usual = None if self.context is None else self.context.control_method(self.link.state())
        self._feed(inputs.Enter(ControlMethod(control_method) if control_method else None, usual))
        self._entering = asyncio.create_task(self._enter(sticks_held), name=f"enter {self.vehicle.id}")
        return await self._ended(self._entering)

    async def _enter(self, sticks_held: bool) -> Sequence[AuditedParameter]:
        try:
            entries = await self._check_entry(sticks_held)
            run = await self._ready_run()  # somebody may have resumed it during the checks
            was_in_hold = self.link.state().mode is FlightMode.HOLD
            self._progress(_S.HOLDING, ReasonCode.OFFBOARD_COMMANDING_HOLD)
            refuse_amid_failsafe(self.link.state())
            await (self.link.hold() if run is None else self._runs.pause(run.id))
            await until_no_failsafe(self.link, self.settings.calm_s)
            if self.control_method is ControlMethod.COMMANDS:
                if was_in_hold:  # by the mode alone it flies on to wherever it was sent last
                    await self.commands.circle_here()
            else:
                self._progress(_S.STREAMING, ReasonCode.OFFBOARD_STREAM_FIRST)
                await self._flow.streamed(self.settings.stream_s)
                self._progress(_S.SWITCHING, ReasonCode.OFFBOARD_ASKING_MODE)
                await self.commands.switch(self.link.enter_offboard())
            self._progress(_S.ACTIVE)
            return entries
        except BaseException as error:
            if self._entering is asyncio.current_task():
                reason = Reason.of(ReasonCode.OFFBOARD_ENTRY_BROKEN_OFF)
                if isinstance(error, WaydropError):
                    reason = Reason.of_error(error.code, error.detail)
                self._feed(inputs.EntryFailed(reason))
            raise

    def _progress(self, state: OffboardState, code: ReasonCode | None = None) -> None:
        """The entry goes on. Raises LeaseLostError: somebody else has changed the mode, which has ended the lease."""
        self._feed(inputs.EntryProgressed(state, None if code is None else Reason.of(code)))
        if self.state is not state:
            raise self._lost_meanwhile()

    async def _check_entry(self, sticks_held: bool) -> Sequence[AuditedParameter]:
        self._fleet.require_new_work()  # another gateway may have the site since the lease was acquired
        await self._ready_run()
        given = self._flow.has_setpoint(self._clock.monotonic(), self.setpoint_source)
        refuse_nothing_to_stream(self.control_method, self._initial_context().kind(self.link.state()), given)
        self._progress(_S.CHECKING, ReasonCode.OFFBOARD_CHECKING)
        entries = await refuse_unsafe_parameters(self.link, self.control_method, sticks_held=sticks_held)
        self.set_context(await with_fence(self._initial_context(), self.link, entries, self._in_thread))
        self._flow.clear()  # it was not measured against this fence
        return entries

    async def _ready_run(self) -> Run | None:
        """The run, which is paused; None without one. Raises OffboardNotReadyError: run or vehicle is not ready."""
        run, state = await self._run(), self.link.state()
        refuse_unready(self.vehicle.id, state, self._initial_context().kind(state), run)
        return run

    def set_context(self, context: ControlContext) -> None:
        """What was read for the entry."""
        self.context = context

    def _initial_context(self) -> ControlContext:
        return initial_context(self.vehicle.id, self.link.identity, self.settings.fresh_s)

    # the way out: a lost lease ends either way, and a new leaving ends the one before ---------------------------

    async def leave(self, lease_id: str, to: Destination) -> None:
        """Leave to a mode, seen, and give the lease back; the setpoint source stops first.

        Raises:
            LeaseLostError, ConflictError, LinkError.
        """
        self.require(lease_id)
        if to == "mission" and self.vehicle.run_id is None:
            raise ConflictError("the vehicle flies no run: there is no mission to resume", hint="leave to hold")
        if self.setpoint_source is not None:
            self.setpoint_source.client_leaves()
        await self.leave_without_renewal(lease_id, to)

    async def leave_without_renewal(self, lease_id: str, to: Destination) -> None:
        """As `leave`, for a setpoint source that has ended: it renews nothing. Raises LeaseLostError, LinkError."""
        self.check(lease_id)
        while self._leaving is not None and not self._leaving.done():
            self._leaving.cancel()
            await asyncio.wait({self._leaving})
        self._leaving = asyncio.create_task(self._leave(lease_id, to), name=f"leave {self.vehicle.id}")
        try:
            await self._ended(self._leaving)
        except LeaseLostError:
            if self._control.has(lease_id):
                raise ConflictError(f"leaving to {to} was aborted: another leave was requested") from None
            raise

    async def _leave(self, lease_id: str, to: Destination) -> None:
        run = await self._run()
        self.check(lease_id)  # it may have ended meanwhile, and Hold been commanded
        self._feed(inputs.Leave(to))
        try:
            await self._command(to, run)
        except BaseException:
            self._feed(inputs.LeavingFailed(to))
            raise
        if self._control.has(lease_id):
            self.end(LeaseChange.RELEASED, Reason.of(ReasonCode.OFFBOARD_LEFT, to=to))

    async def _command(self, to: Destination, run: Run | None) -> None:
        if to == "hold" and (run is None or self.control_method is ControlMethod.COMMANDS):
            await self._hold()
        if run is None:
            if to == "return":
                await self.link.return_to_launch()
        elif to == "mission":
            await self._runs.resume(run.id)
        elif to == "return":
            await self._runs.return_to_launch(run.id)
        else:
            await self._runs.pause(run.id)

    async def _ended(self, task: asyncio.Task[T]) -> T:
        try:
            await asyncio.wait({task})
        finally:
            task.cancel()
        if task.cancelled():
            raise self._lost_meanwhile()
        return task.result()

    def _lost_meanwhile(self) -> LeaseLostError:
        why = describe(self.reason) if self.lease is None else f"{self.lease.holder} has acquired it"
        return LeaseLostError(f"the lease ended meanwhile: {why}", hint="take it again")

    async def _run(self) -> Run | None:
        run_id = self.vehicle.run_id
        return None if run_id is None else await self._runs.get(run_id)

    # inputs and effects ---------------------------------------------------------------------------------------

    def _feed(self, happened: inputs.AnyInput, now_s: float | None = None) -> None:
        now_s = self._clock.monotonic() if now_s is None else now_s
        self._control, effects = step(self._control, Input(happened, now_s, self.link.state()))
        for effect in effects:
            self._carry_out(effect, now_s)

    def _carry_out(self, effect: Effect, now_s: float) -> None:
        match effect:
            case StartStream(rate_hz):
                self.context = self._initial_context()
                self._flow.start(rate_hz)
                self._rate_loop.start(rate_hz)
            case RecordLease(change, holder, other, reason):
                lease = OffboardLease(change=change, holder=holder, other=other, reason=reason)
                self._fleet.record(self.vehicle, lease)
            case RecordState(state, holder, reason):
                self._fleet.record(self.vehicle, OffboardChanged(state=state, holder=holder, reason=reason))
            case ControlAction.CLEAR_SETPOINT:
                self._flow.clear()
            case ControlAction.RESTART_DEAD_MAN:
                self._flow.count_from(now_s)
            case ControlAction.SEND_SETPOINT | ControlAction.SEND_COMMAND:
                self._send(effect, now_s)
            case ControlAction.COMMAND_HOLD:
                _cancel(self._holding)
                self._holding = asyncio.create_task(self._command_hold(), name=f"hold {self.vehicle.id}")
            case ControlAction.CANCEL_HOLD:
                _cancel(self._holding)
            case ControlAction.STOP_ENTERING_OR_LEAVING:
                self._stop_entering_or_leaving()
            case ControlAction.STOP:
                self._rate_loop.stop()
                self._flow.clear()
                self.commands.forget()
                self._stop_entering_or_leaving()
            case ControlAction.NOTIFY:
                self.changed()

    def _stop_entering_or_leaving(self) -> None:
        _cancel(self._entering)
        self._entering = None  # how it ends says nothing of the next lease
        if self._leaving is not asyncio.current_task():  # one that has succeeded ends its lease itself
            _cancel(self._leaving)

    def _tick(self, now_s: float) -> None:
        self._feed(inputs.Tick(), now_s)
        try:
            if (source := self.setpoint_source) is not None:
                self._flow.note(source.tick(now_s))
            self._feed(inputs.SetpointDue(), now_s)
        except WaydropError as error:
            reason = Reason.of(ReasonCode.OFFBOARD_CANNOT_SEND, error=error.code, detail=error.detail)
            self.give_up(LeaseChange.REVOKED, reason)

    def _send(self, action: ControlAction, now_s: float) -> None:
        """Raises LinkError, SetpointRefusedError."""
        if self.context is None:
            return
        state = self.link.state()
        if action is ControlAction.SEND_SETPOINT:
            gone = self._flow.tick(self.state, self.context, state, now_s)
        else:
            gone = self.commands.tick(now_s, self.context.kind(state))
        if gone:
            self.give_up(LeaseChange.REVOKED, gone)

    def _on_defect(self) -> None:
        """Without ticks there is neither a stream nor a dead-man: a defect in one is Hold."""
        self.give_up(LeaseChange.REVOKED, Reason.of(ReasonCode.OFFBOARD_DEFECT))

    def _on_gap(self, gap_s: float) -> None:
        """What was meant before may not be meant now: nothing is sent, Hold neither. The vehicle's failsafe acts."""
        self.end(LeaseChange.REVOKED, Reason.of(ReasonCode.OFFBOARD_STOOD_STILL, gap_s=gap_s))

    def _check_gap(self) -> None:
        if self.state is not _S.IDLE:
            self._rate_loop.check_gap()

    def _link_fact_received(self, fact: LinkFact) -> None:
        """What the vehicle did while the service stood still has that as its cause, so it is asked first."""
        self._check_gap()
        self._feed(inputs.LinkFactReceived(fact))

    def _slot(self, setpoint: Setpoint, source: Author) -> tuple[Clamp, ...]:
        if self.context is None:
            raise LeaseLostError("the lease has ended")
        if self.control_method is ControlMethod.COMMANDS and self.state is not _S.LEASED:
            raise SetpointRefusedError(
                "the vehicle is controlled by commands in Hold mode and follows no setpoints",
                refusal="setpoint.flown_by_commands",
                hint='leave, and enter with "control_method": "setpoints"',
            )
        return self._flow.put(setpoint, self.context, self.link.state(), self._clock.monotonic(), source)

    def _put_out(self, message: SetpointMessage) -> None:
        """A last look before a message leaves: the process may have stood still in the middle of a tick."""
        self._check_gap()
        if self.state is not _S.IDLE:
            self.link.send_setpoint(message)

    async def _hold(self) -> None:
        """Hold, seen; a commanded wing is in Hold and is commanded to circle where it is. Raises LinkError."""
        circles = self.control_method is ControlMethod.COMMANDS
        await (self.commands.circle_here() if circles else self.commands.switch(self.link.hold()))

    async def _command_hold(self) -> None:
        """In a task of its own, because what ends control does not wait."""
        unconfirmed = ""
        try:
            await self._hold()
        except WaydropError as error:
            unconfirmed = error.detail
            log.warning("Hold mode after offboard control not confirmed", vehicle=self.vehicle.id, error=unconfirmed)
        self._feed(inputs.HoldAnswered(unconfirmed))


def _cancel(task: asyncio.Task[Sequence[AuditedParameter]] | asyncio.Task[None] | None) -> None:
    if task is not None:
        task.cancel()
