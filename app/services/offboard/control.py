"""One vehicle under offboard control: its lease, its stream, its dead-man, and who took it away."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Final

import structlog

from app.domain.errors import LeaseLostError, OffboardNotReadyError, WaydropError
from app.domain.events import EventKind
from app.domain.ports import LinkFact, Unsubscribe, VehicleLink
from app.domain.setpoint.capability import firmware_profile
from app.domain.setpoint.dead_man import Silence, can_stand
from app.domain.setpoint.encode import encode
from app.domain.setpoint.forms import Setpoint
from app.domain.setpoint.limiter import Clamp, limit
from app.domain.setpoint.message import SetpointMessage
from app.domain.vehicle import FlightMode
from app.services.clock import Clock
from app.services.fleet import Fleet, FleetVehicle
from app.services.offboard.guide import Guide
from app.services.offboard.lease import Lease, LeaseSlot
from app.services.offboard.loss import ended_by
from app.services.offboard.pacer import Pacer
from app.services.offboard.settings import OffboardSettings
from app.services.offboard.stream import Author, SetpointStream, Slotted
from app.services.offboard.surroundings import Surroundings
from app.services.offboard_view import LeaseView, OffboardState, OffboardView

log = structlog.get_logger(__name__)
_S = OffboardState
SENDING: Final = frozenset({_S.STREAMING, _S.SWITCHING, _S.ACTIVE, _S.LEAVING})


class OffboardControl:
    """All of it runs on the event loop. Nothing is sent but by a tick, and no tick sends without a lease."""

    def __init__(self, vehicle: FleetVehicle, fleet: Fleet, clock: Clock, settings: OffboardSettings) -> None:
        self.vehicle = vehicle
        self.settings = settings
        self.state = _S.IDLE
        self.reason = ""
        self.surroundings: Surroundings | None = None
        self._fleet = fleet
        self._clock = clock
        self._leases = LeaseSlot(vehicle.id, settings.lease_s)
        self._stream = SetpointStream(self._put_out, settings.dead_man.max_age_s, settings.rate_hz)
        self._pacer: Pacer | None = None
        self._ticking: asyncio.Task[None] | None = None
        self._holding: asyncio.Task[None] | None = None
        self._spoke_s = 0.0
        self._listeners: list[Callable[[], None]] = []
        self.guide: Guide | None = None
        self._unsubscribe = vehicle.link.subscribe(self._heard)
        vehicle.offboard = self.view_if_used

    # what clients do ------------------------------------------------------------------------------------------

    def take(self, holder: str, *, rate_hz: float, override: bool = False) -> Lease:
        """The lease. Taken over in flight, the new holder must speak before the dead-man acts.

        Raises:
            LeaseHeldError: another client has it. VehicleQuarantinedError. OffboardNotReadyError: its type is unknown.
        """
        self._stood_still()
        self._fleet.link(self.vehicle.id)
        who, now_s = self.vehicle.link.identity, self._clock.monotonic()
        if who.vehicle_type is None:
            raise OffboardNotReadyError(f"the type of vehicle {self.vehicle.id} is not known yet", hint="wait a moment")
        self._end_expired(now_s)
        before = self._leases.lease
        lease = self._leases.take(holder, now_s, override=override)
        self._stream.clear()
        self._spoke_s = now_s
        if before is not None and self.state is not _S.IDLE:
            self._tell_lease("handed_over" if before.offered_to == holder else "overridden", holder, before.holder)
            self.changed()
            return lease
        profile = firmware_profile(who.firmware)
        self.surroundings = Surroundings(who.vehicle_type, profile, self.settings.fresh_s)
        self._stream = SetpointStream(self._put_out, self.settings.dead_man.max_age_s, rate_hz)
        period_s, gap_s = 1.0 / rate_hz, self.settings.gap_s
        self._pacer = Pacer(period_s, gap_s, self._tick, self._on_gap, monotonic=self._clock.monotonic)
        self._ticking = asyncio.create_task(self._pacer.run(), name=f"offboard {self.vehicle.id}")
        self._ticking.add_done_callback(self._ticks_ended)
        self._tell_lease("taken", holder, "")
        self.move(_S.LEASED, "")
        return lease

    def require(self, lease_id: str) -> Lease:
        """Renew the lease. Raises LeaseLostError."""
        self._stood_still()
        return self._leases.require(lease_id, self._clock.monotonic())

    def check(self, lease_id: str) -> Lease:
        """Look whether it is still this lease, and renew nothing. Raises LeaseLostError."""
        self._stood_still()
        return self._leases.check(lease_id, self._clock.monotonic())

    def offer(self, lease_id: str, to: str | None) -> Lease:
        """Let `to` take the lease over. Raises LeaseLostError."""
        lease = self._leases.offer(self.require(lease_id).id, to, self._clock.monotonic())
        self._tell_lease("offered", lease.holder, f"to {to}" if to else "withdrawn")
        self.changed()
        return lease

    def put(self, lease_id: str, setpoint: Setpoint) -> tuple[Clamp, ...]:
        """The newest setpoint, sent from the next tick on if the vehicle is under control. What was clamped of it.

        Raises:
            LeaseLostError; SetpointRefusedError: it is not sent, and the one before it goes on to its age.
        """
        self.require(lease_id)
        clamps = self._slot(setpoint, "client")
        if self.guide is not None:
            self.guide.overruled()
        return clamps

    def steer(self, setpoint: Setpoint) -> tuple[Clamp, ...]:
        """A setpoint of the guide, like the client's own, but it renews no lease: the client must do that.

        Raises:
            LeaseLostError; SetpointRefusedError.
        """
        return self._slot(setpoint, "task")

    def release(self, lease_id: str, reason: str) -> None:
        """The holder gives the lease up, or its socket closed: Hold if the vehicle is flown. Raises LeaseLostError."""
        self.require(lease_id)
        self.give_up("released", reason)

    # what the parts of this package use -----------------------------------------------------------------------

    @property
    def link(self) -> VehicleLink:
        """The vehicle's link."""
        return self.vehicle.link

    @property
    def lease(self) -> Lease | None:
        """The lease now."""
        return self._leases.lease

    async def streamed(self, seconds: float) -> None:
        """Return when so much of the stream has been sent."""
        await self._stream.until_sent(round(seconds * self._stream.cadence.wanted_hz))

    def move(self, state: OffboardState, reason: str) -> None:
        """The next state. Under control the dead-man counts from here."""
        if state is _S.ACTIVE:
            self._spoke_s = max(self._spoke_s, self._clock.monotonic())
        if state is not self.state or reason != self.reason:
            self.state, self.reason = state, reason
            holder = None if self.lease is None else self.lease.holder
            self._fleet.tell(EventKind.OFFBOARD_CHANGED, self.vehicle, state=state.value, holder=holder, reason=reason)
        self.changed()

    def forget_setpoint(self) -> None:
        """What was put before does not count any more."""
        self._stream.clear()

    def enclose(self, surroundings: Surroundings) -> None:
        """What was read for the entry."""
        self.surroundings = surroundings

    def give_up(self, change: str, reason: str) -> None:
        """End the lease, stop sending, and command Hold if the vehicle follows our stream."""
        follows = self.state in SENDING and self.link.state().mode in (FlightMode.OFFBOARD, None)
        follows = follows or self.state is _S.SWITCHING
        self.end(change, reason)
        if follows:
            self._holding = asyncio.create_task(self._hold(), name=f"hold {self.vehicle.id}")

    def end(self, change: str, reason: str) -> None:
        """End the lease and stop sending; command nothing. Idempotent."""
        if self._ticking is not None:
            self._ticking.cancel()
            self._ticking = None
        lease, self._leases.lease = self._leases.lease, None
        self._stream.clear()
        if lease is not None:
            self._tell_lease(change, lease.holder, reason)
            self.move(_S.IDLE, reason)

    def subscribe(self, listener: Callable[[], None]) -> Unsubscribe:
        """Call `listener` when state or lease have changed."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener) if listener in self._listeners else None

    def view(self) -> OffboardView:
        """How it is now."""
        now_s, lease = self._clock.monotonic(), self.lease
        held = None
        if lease is not None:
            left_s = round(max(0.0, lease.expires_s - now_s), 1)
            held = LeaseView(holder=lease.holder, expires_in_s=left_s, offered_to=lease.offered_to)
        sent = self._stream.sent_view(now_s) if self.state in SENDING else None
        cadence = self._stream.cadence.view() if self.state in SENDING else None
        tasks = None if self.guide is None else self.guide.report()
        return OffboardView(state=self.state, lease=held, reason=self.reason, sent=sent, cadence=cadence, tasks=tasks)

    def view_if_used(self) -> OffboardView | None:
        """For telemetry: nothing while nobody has ever had a lease."""
        return None if self.state is _S.IDLE and not self.reason else self.view()

    async def close(self) -> None:
        """The service ends: Hold for what it flies, within a bound; the vehicle's own failsafe does the rest."""
        self.give_up("revoked", "the service stops")
        if self._holding is not None:
            await asyncio.wait({self._holding}, timeout=self.settings.goodbye_s)
            self._holding.cancel()
        self._unsubscribe()

    # ticks and facts ------------------------------------------------------------------------------------------

    def _tick(self, now_s: float) -> None:
        self._end_expired(now_s)
        try:
            if self.guide is not None:
                self.guide.tick(now_s)
            if self.state in SENDING and self.surroundings is not None:
                self._send(now_s, self.surroundings)
        except WaydropError as error:
            self.give_up("revoked", f"cannot send: {error.detail}")

    def _ticks_ended(self, ticking: asyncio.Task[None]) -> None:
        """Without ticks there is neither a stream nor a dead-man: a defect in one is Hold."""
        if ticking.cancelled() or (error := ticking.exception()) is None:
            return
        log.error("a defect ended the ticks of offboard control", vehicle=self.vehicle.id, exc_info=error)
        if ticking is self._ticking:
            self.give_up("revoked", "a defect of the service: nothing more can be sent")

    def _slot(self, setpoint: Setpoint, by: Author) -> tuple[Clamp, ...]:
        if self.surroundings is None:
            raise LeaseLostError("the lease has ended")
        state = self.link.state()
        follower = self.surroundings.follower(state)
        encode(setpoint, follower)  # refused by the table before any limit is looked at
        limited = limit(setpoint, self.settings.limits, self.surroundings.whereabouts(state))
        now_s = self._clock.monotonic()
        self._stream.put(Slotted(limited.setpoint, encode(limited.setpoint, follower), limited.clamps, now_s, by))
        self._spoke_s = now_s
        return limited.clamps

    def _end_expired(self, now_s: float) -> None:
        if self._leases.has_expired(now_s):
            self.give_up("expired", f"not renewed for {self.settings.lease_s:g} s")

    def _send(self, now_s: float, surroundings: Surroundings) -> None:
        state = self.link.state()
        follower = surroundings.follower(state)
        if self.state is _S.LEAVING:
            if state.mode is FlightMode.OFFBOARD and not self._stream.send_fresh(now_s) and can_stand(follower.kind):
                self._stream.send_zero(follower, now_s)
            return
        silent_s = now_s - self._spoke_s if self.state is _S.ACTIVE else 0.0
        silence = self.settings.dead_man.judge(silent_s, follower.kind, has_estimate=follower.has_estimate)
        if silence is Silence.GONE:
            self.give_up("revoked", f"the client was silent for {silent_s:.1f} s")
        elif not self._stream.send_fresh(now_s):
            self._stream.send_zero(follower, now_s)  # a wing does not follow it: that is refused and ends the lease

    def _put_out(self, message: SetpointMessage) -> None:
        """A last look before a message leaves: the process may have stood still in the middle of a tick."""
        self._stood_still()
        if self.state is not _S.IDLE:
            self.link.send_setpoint(message)

    def _heard(self, fact: LinkFact) -> None:
        """Somebody else's mode is never fought for: the stream ends at once, or it would pull the vehicle back."""
        if self.state is not _S.IDLE and (reason := ended_by(fact, self.state, self.link)):
            self.end("revoked", reason)

    def _stood_still(self) -> None:
        if self._pacer is not None and self.state is not _S.IDLE:
            self._pacer.stood_still()

    def _on_gap(self, gap_s: float) -> None:
        """What was meant before may not be meant now: nothing is sent, Hold neither. The vehicle's failsafe acts."""
        self.end("revoked", f"the service stood still for {gap_s:.1f} s")

    async def _hold(self) -> None:
        try:
            await self.link.hold()
        except WaydropError as error:
            reason = f"{self.reason}; Hold is not confirmed ({error.detail}): the vehicle's own failsafe acts"
            log.warning("hold after offboard control not confirmed", vehicle=self.vehicle.id, error=error.detail)
            if self.state is _S.IDLE:
                self.move(_S.IDLE, reason)

    def _tell_lease(self, change: str, holder: str, reason: str) -> None:
        self._fleet.tell(EventKind.OFFBOARD_LEASE, self.vehicle, change=change, holder=holder, reason=reason)

    def changed(self) -> None:
        """Tell the listeners to look again."""
        for listener in tuple(self._listeners):
            listener()
