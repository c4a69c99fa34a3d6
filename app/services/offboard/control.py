"""One vehicle under offboard control: its lease, its stream, its dead-man, and who took it away."""

from __future__ import annotations

from collections.abc import Callable

from app.domain.errors import LeaseLostError, OffboardNotReadyError, SetpointRefusedError, WaydropError
from app.domain.events.vehicle import OffboardChanged, OffboardLease
from app.domain.offboard.modes import ended_by, who_acts
from app.domain.offboard.state import LeaseChange, OffboardState
from app.domain.ports import LinkFact, StateChanged, Unsubscribe, VehicleLink
from app.domain.setpoint.forms import Setpoint
from app.domain.setpoint.limiter import Clamp
from app.domain.setpoint.means import Means
from app.domain.setpoint.message import SetpointMessage
from app.domain.vehicle import FlightMode
from app.services.clock import Clock
from app.services.fleet import Fleet, FleetVehicle
from app.services.offboard.guide import Guide
from app.services.offboard.holding import Holding
from app.services.offboard.lease import Lease, LeaseSlot
from app.services.offboard.orders import Orders
from app.services.offboard.setpoint_flow import SENDING, SetpointFlow
from app.services.offboard.settings import OffboardSettings
from app.services.offboard.stream import Author
from app.services.offboard.surroundings import Surroundings
from app.services.offboard.ticking import Ticking
from app.services.offboard_view import OffboardView

_S = OffboardState


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
        self.means = Means.SETPOINTS
        self.orders = Orders(vehicle.link, clock, settings.dead_man.gone_s, self.changed)
        self.flow = SetpointFlow(settings, self._put_out)
        self._ticking = Ticking(vehicle.id, clock, settings.gap_s, self._tick, self._on_gap, self._on_defect)
        self._holding = Holding(vehicle.id, self.hold, self._hold_unconfirmed)
        self._listeners: list[Callable[[], None]] = []
        self.guide: Guide | None = None
        self.commanded = ""
        """What a person has commanded beside the lease, since it was taken."""
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
        self.flow.clear()
        self.flow.count_from(now_s)
        if before is not None and self.state is not _S.IDLE:
            if self._is_commanded:
                self._holding.soon()
            change = LeaseChange.HANDED_OVER if before.offered_to == holder else LeaseChange.OVERRIDDEN
            self._tell_lease(change, holder, before.holder)
            self.changed()
            return lease
        self.surroundings = Surroundings.of(who.vehicle_type, who.firmware, self.settings.fresh_s)
        self.means = self.surroundings.means(self.link.state()) or Means.SETPOINTS
        self.commanded = ""
        self.flow.start(rate_hz)
        self._ticking.start(rate_hz)
        self._tell_lease(LeaseChange.TAKEN, holder, "")
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
        self._tell_lease(LeaseChange.OFFERED, lease.holder, f"to {to}" if to else "withdrawn")
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
        self.give_up(LeaseChange.RELEASED, reason)

    # what the parts of this package use -----------------------------------------------------------------------

    @property
    def link(self) -> VehicleLink:
        """The vehicle's link."""
        return self.vehicle.link

    @property
    def lease(self) -> Lease | None:
        """The lease now."""
        return self._leases.lease

    def move(self, state: OffboardState, reason: str) -> None:
        """The next state. Under control the dead-man counts from here."""
        if state is _S.ACTIVE:
            self.flow.count_from(self._clock.monotonic())
        if state is not self.state or reason != self.reason:
            self.state, self.reason = state, reason
            holder = None if self.lease is None else self.lease.holder
            self._fleet.tell(self.vehicle, OffboardChanged(state=state, holder=holder, reason=reason))
        self.changed()

    async def hold(self) -> None:
        """Hold, seen; a commanded wing is in Hold and is told to circle where it is. Raises LinkError."""
        await (self.orders.circle_here() if self._is_commanded else self.orders.switch(self.link.hold()))

    def say_no_last_word(self) -> None:
        """Whatever is commanded now is newer than the Hold that the end of control has left under way."""
        self._holding.cancel()

    def forget_setpoint(self) -> None:
        """What was put before does not count any more."""
        self.flow.clear()

    def enclose(self, surroundings: Surroundings) -> None:
        """What was read for the entry."""
        self.surroundings = surroundings

    def give_up(self, change: LeaseChange, reason: str) -> None:
        """End the lease, stop sending, and command Hold if the vehicle follows our stream."""
        mode = FlightMode.HOLD if self._is_commanded else FlightMode.OFFBOARD
        follows = self.state is _S.SWITCHING or (self.state in SENDING and self.link.state().mode in (mode, None))
        self.end(change, reason)
        if follows:
            self._holding.soon()

    def end(self, change: LeaseChange, reason: str) -> None:
        """End the lease and stop sending; command nothing. Idempotent."""
        self._ticking.stop()
        lease, self._leases.lease = self._leases.lease, None
        self.flow.clear()
        self.orders.forget()
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
        streams = self.state in SENDING and not self._is_commanded
        sent, cadence = self.flow.views(now_s) if streams else (None, None)
        return OffboardView(
            state=self.state,
            lease=None if lease is None else lease.view(now_s),
            reason=self.reason,
            sent=sent,
            cadence=cadence,
            tasks=None if self.guide is None else self.guide.report(),
            flown_by=None if lease is None else self.means.value,
            order=self.orders.view(now_s),
        )

    def view_if_used(self) -> OffboardView | None:
        """For telemetry: nothing while nobody has ever had a lease."""
        return None if self.state is _S.IDLE and not self.reason else self.view()

    async def close(self) -> None:
        """The service ends: Hold for what it flies, within a bound; the vehicle's own failsafe does the rest."""
        self.give_up(LeaseChange.REVOKED, "the service stops")
        await self._holding.end(self.settings.goodbye_s)
        self._unsubscribe()

    # ticks and facts ------------------------------------------------------------------------------------------

    def _tick(self, now_s: float) -> None:
        self._end_expired(now_s)
        try:
            if self.guide is not None:
                self.guide.tick(now_s)
            if gone := self._act(now_s):
                self.give_up(LeaseChange.REVOKED, gone)
        except WaydropError as error:
            self.give_up(LeaseChange.REVOKED, f"cannot send: {error.detail}")

    def _on_defect(self) -> None:
        """Without ticks there is neither a stream nor a dead-man: a defect in one is Hold."""
        self.give_up(LeaseChange.REVOKED, "a defect of the service: nothing more can be sent")

    def _slot(self, setpoint: Setpoint, by: Author) -> tuple[Clamp, ...]:
        if self.surroundings is None:
            raise LeaseLostError("the lease has ended")
        if self._is_commanded and self.state is not _S.LEASED:
            raise SetpointRefusedError(
                "it is flown by commands, in Hold: a setpoint would not be followed",
                refusal="setpoint.flown_by_commands",
                hint='leave, and enter with "by": "setpoints"',
            )
        return self.flow.put(setpoint, self.surroundings, self.link.state(), self._clock.monotonic(), by)

    def _end_expired(self, now_s: float) -> None:
        if self._leases.has_expired(now_s):
            self.give_up(LeaseChange.EXPIRED, f"not renewed for {self.settings.lease_s:g} s")

    def _act(self, now_s: float) -> str:
        """Send, or give orders. Why the lease must end, in words. Raises LinkError, SetpointRefusedError."""
        if self.surroundings is None:
            return ""
        if not self._is_commanded:
            return self.flow.tick(self.state, self.surroundings, self.link.state(), now_s)
        if self.state is not _S.ACTIVE or self._holding.is_under_way:
            return ""  # an order now would be ended by the last word that is still being said
        if acts := who_acts(self.link.state()):  # seen while it was being left, which has failed
            self.end(LeaseChange.REVOKED, acts)
            return ""
        return self.orders.tick(now_s, self.surroundings.kind(self.link.state()))

    def _put_out(self, message: SetpointMessage) -> None:
        """A last look before a message leaves: the process may have stood still in the middle of a tick."""
        self._stood_still()
        if self.state is not _S.IDLE:
            self.link.send_setpoint(message)

    def _heard(self, fact: LinkFact) -> None:
        """Somebody else's mode is never fought for: stream and last word end at once, or they would pull it back.

        What the vehicle did while the service stood still has that as its cause, so it is asked first.
        """
        self._stood_still()
        if self._holding.is_under_way and self._others_act():
            self._holding.cancel()
        self._end_if_taken(fact)

    def _others_act(self) -> bool:
        """While the last word is said: OFFBOARD, out of which it leads, is ours."""
        state = self.link.state()
        return bool(who_acts(state)) and (self._is_commanded or state.mode is not FlightMode.OFFBOARD)

    def look_again(self) -> None:
        """A leaving has failed: the vehicle may have left OFFBOARD all the same."""
        self._end_if_taken(StateChanged())

    def _end_if_taken(self, fact: LinkFact) -> None:
        if self.state is not _S.IDLE and (
            reason := ended_by(fact, self.state, self.means, self.link.state(), self.commanded)
        ):
            self.end(LeaseChange.REVOKED, reason)

    def _stood_still(self) -> None:
        if self.state is not _S.IDLE:
            self._ticking.look()

    def _on_gap(self, gap_s: float) -> None:
        """What was meant before may not be meant now: nothing is sent, Hold neither. The vehicle's failsafe acts."""
        self.end(LeaseChange.REVOKED, f"the service stood still for {gap_s:.1f} s")

    @property
    def _is_commanded(self) -> bool:
        return self.means is Means.COMMANDS

    def _hold_unconfirmed(self, detail: str) -> None:
        if self.state is _S.IDLE and not (self._is_commanded and who_acts(self.link.state())):
            acts = "it circles at its last place" if self._is_commanded else "the vehicle's own failsafe acts"
            self.move(_S.IDLE, f"{self.reason}; Hold is not confirmed ({detail}): {acts}")

    def _tell_lease(self, change: LeaseChange, holder: str, reason: str) -> None:
        self._fleet.tell(self.vehicle, OffboardLease(change=change, holder=holder, reason=reason))

    def changed(self) -> None:
        """Tell the listeners to look again."""
        for listener in tuple(self._listeners):
            listener()
