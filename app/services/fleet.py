"""The fleet: all vehicles by ID, with their changes recorded in the journal."""

from __future__ import annotations

import asyncio
import itertools
import re
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Protocol

import structlog

from app.domain.autopilot import autopilot
from app.domain.autopilot.declared import PerformanceRegistry, declared_for
from app.domain.errors import NotFoundError, StorageError, VehicleQuarantinedError, WaydropError
from app.domain.events import AnyPayload, NewEvent
from app.domain.events import vehicle as events
from app.domain.ports.vehicle_link import LinkSource, Unsubscribe, VehicleLink
from app.domain.reasons import Reason
from app.domain.vehicle import facts as link_facts
from app.domain.vehicle.facts import LinkFact, QuarantineChange
from app.domain.vehicle.state import LandedState, VehicleProfile, VehicleState
from app.services.background import begin_task, end_tasks
from app.services.journal import Journal
from app.services.views import OffboardView, StateView, VehicleView

log = structlog.get_logger(__name__)
WAITING_EVENTS: Final = 4096
WAITING_TEXTS: Final = 256
BATCH: Final = 100


class OffboardObserver(Protocol):
    """What the fleet shows of offboard control, and what it notifies it of."""

    def view_if_used(self) -> OffboardView | None:
        """The state of offboard control; None without a lease so far."""

    def commanded(self, action: str) -> None:
        """Somebody commands the vehicle; an empty action: that failed."""


@dataclass(slots=True, eq=False)
class FleetVehicle:
    """One vehicle of the fleet. `run_id` is the run that owns it now."""

    id: str
    link: VehicleLink
    declared: PerformanceRegistry
    quarantined: Reason | None = None
    run_id: str | None = None
    unsubscribe: Unsubscribe = field(default=lambda: None)
    recorded: events.VehicleChanged | None = None
    _offboard: OffboardObserver | None = None

    def own(self, run_id: str) -> None:
        """A run has the vehicle from now on."""
        self.run_id = run_id

    def release(self, run_id: str) -> None:
        """The run is over, or was not created; another one keeps the vehicle."""
        if self.run_id == run_id:
            self.run_id = None

    def observe(self, observer: OffboardObserver) -> None:
        """Offboard control shows how it flies the vehicle, and is notified of commands."""
        self._offboard = observer

    def offboard(self) -> OffboardView | None:
        """How offboard control flies it; None if it does not."""
        return None if self._offboard is None else self._offboard.view_if_used()

    def commanded(self, action: str) -> None:
        """Notify offboard control of hold, return, land and resume before they are sent; an empty action failed.

        A fixed wing in Hold shows no change by Hold, and a pending command of offboard control must not follow.
        """
        if self._offboard is not None:
            self._offboard.commanded(action)

    def view(self) -> VehicleView:
        who = self.link.identity
        return VehicleView(
            id=self.id,
            system_id=who.system_id,
            vehicle_type=who.vehicle_type,
            firmware=None if who.firmware is None else str(who.firmware),
            uid=who.uid,
            connection=who.connection,
            quarantined=self.quarantined,
            run_id=self.run_id,
            performance=declared_for(self.declared, self.id, who.uid, who.vehicle_type),
            state=StateView.of(self.link.state(), self.offboard()),
        )


class EventBacklog:
    """Events of the vehicles on their way to the journal, in order. Texts have places of their own, and fill no others.

    `lost` counts what found no place, by whether it was a text.
    """

    def __init__(self, most: int = WAITING_EVENTS, most_texts: int = WAITING_TEXTS) -> None:
        self._most = {False: most, True: most_texts}
        self._count = {False: 0, True: 0}
        self._waiting: deque[tuple[NewEvent, bool]] = deque(maxlen=most + most_texts)
        self._filled = asyncio.Event()
        self._emptied = asyncio.Event()
        self._emptied.set()
        self.lost = {False: 0, True: 0}

    def put(self, event: NewEvent, *, is_text: bool) -> bool:
        """Whether there was a place."""
        if self._count[is_text] >= self._most[is_text]:
            self.lost[is_text] += 1
            return False
        self._count[is_text] += 1
        self._waiting.append((event, is_text))
        self._filled.set()
        self._emptied.clear()
        return True

    async def take(self, most: int) -> list[NewEvent]:
        """The oldest ones, at least one. They keep their places until `done`."""
        await self._filled.wait()
        return [event for event, _ in itertools.islice(self._waiting, most)]

    def done(self, count: int) -> None:
        """This many of the oldest events are recorded, or dropped."""
        for _ in range(count):
            _, is_text = self._waiting.popleft()
            self._count[is_text] -= 1
        if not self._waiting:
            self._filled.clear()
            self._emptied.set()

    async def drained(self) -> None:
        """Return when none waits."""
        await self._emptied.wait()


class Fleet:
    """Knows all vehicles. Facts arrive synchronously from the links; one task records them in order.

    Vehicles are `v1`, and `north-v1` at the site `north` of a cluster, where system ids repeat.
    """

    def __init__(
        self, source: LinkSource, journal: Journal, declared: PerformanceRegistry | None = None, site: str | None = None
    ) -> None:
        self._source = source
        self._journal = journal
        self._declared = declared or {}
        self._prefix = "v" if site is None else f"{site}-v"
        self._vehicles: dict[str, FleetVehicle] = {}
        self._backlog = EventBacklog()
        self._recorder: asyncio.Task[None] | None = None
        self._unsubscribe: Unsubscribe = lambda: None
        self._gate: Callable[[], WaydropError | None] = lambda: None
        self._commands_gate: Callable[[], bool] = lambda: True
        self._is_left: Callable[[str], bool] = lambda run_id: False

    async def start(self) -> None:
        """Open the connections and discover vehicles. Raises LinkError."""
        self._recorder = begin_task(self._record_all(), "fleet recorder")
        self._unsubscribe = self._source.subscribe(self._found)
        for link in self._source.links():
            self._found(link)
        await self._source.start()

    async def close(self) -> None:
        """Record what waits, then close the links. Idempotent."""
        self._unsubscribe()
        for vehicle in self._vehicles.values():
            vehicle.unsubscribe()
        if self._recorder is not None:
            await self.recorded()
            await end_tasks(self._recorder)
            self._recorder = None
        await self._source.close()

    async def recorded(self) -> None:
        """Return when all previous events are in the journal, or dropped."""
        await self._backlog.drained()

    def vehicles(self) -> Sequence[VehicleView]:
        """All vehicles, by id."""
        return [vehicle.view() for vehicle in self.each()]

    def each(self) -> Sequence[FleetVehicle]:
        """The vehicles themselves, by id: without what is shown of them."""
        return [self._vehicles[key] for key in sorted(self._vehicles, key=_by_number)]

    def view(self, vehicle_id: str) -> VehicleView:
        """One vehicle. Raises NotFoundError."""
        return self.vehicle(vehicle_id).view()

    def vehicle(self, vehicle_id: str) -> FleetVehicle:
        """The vehicle itself, quarantined or not. Raises NotFoundError."""
        found = self._vehicles.get(vehicle_id)
        if found is None:
            known = ", ".join(sorted(self._vehicles, key=_by_number)) or "none yet"
            raise NotFoundError(
                f"no vehicle {vehicle_id!r} has connected since the service started",
                hint=f"connected so far: {known}. Of one that is off, runs and jobs are listed",
            )
        return found

    def link(self, vehicle_id: str) -> VehicleLink:
        """The link to command a vehicle, but Hold, Return and Land. Raises NotFoundError, VehicleQuarantinedError."""
        vehicle = self.vehicle(vehicle_id)
        if vehicle.quarantined is not None:
            raise VehicleQuarantinedError(
                f"vehicle {vehicle_id} is quarantined: two vehicles have its system id",
                hint=f"give each vehicle its own {autopilot().system_id_name}. The quarantine ends when one of them is "
                "silent, or an admin ends it; hold, return and land are always sent",
            )
        return vehicle.link

    def gate_new_work(self, gate: Callable[[], WaydropError | None]) -> None:
        """From now on the gate says why nothing new may begin: no run, start, mission change or offboard control."""
        self._gate = gate

    def gate_commands(self, gate: Callable[[], bool]) -> None:
        """From now on the gate says whether runs may command by themselves; what a person commands is always sent."""
        self._commands_gate = gate

    def may_command(self, run_id: str) -> bool:
        """Whether a run may command by itself: release a drop, fly on after it, or act on its failure."""
        return self._commands_gate() and not self._is_left(run_id)

    def why_no_new_work(self) -> str | None:
        """Why nothing new may begin; None: it may. Hold, return and land are always sent."""
        error = self._gate()
        return None if error is None else error.detail

    def gate_runs(self, is_left: Callable[[str], bool]) -> None:
        """From now on a run commands nothing by itself, and is not followed anew, while `is_left` says that another
        gateway followed it, and how it went on is not known here.
        """
        self._is_left = is_left

    async def until_may_follow(self, run_id: str, poll_s: float) -> None:
        """Return once this run may command here, and none waits to be taken over from another gateway.

        To follow it anew would record that its drop was kept, even where the other gateway released it.
        """
        while True:
            if self.may_command(run_id) and self._gate() is None:
                return
            await asyncio.sleep(poll_s)

    def why_not_followed(self, run_id: str, vehicle_id: str, unread: str | None) -> str:
        """Why an open run of this vehicle is not followed here yet. `unread`: what kept its mission from being read."""
        if (why := self.why_no_new_work()) is not None:
            return why
        if self._is_left(run_id):
            return "another gateway followed it, and no API node has told how it went on"
        vehicle = self._vehicles.get(vehicle_id)
        if vehicle is None:
            return "its vehicle has not connected since the service started"
        if vehicle.quarantined is not None:
            return "its vehicle is quarantined: two vehicles have its system id"
        if not vehicle.link.state().connected:
            return "the link to its vehicle is lost"
        if unread is not None:
            return f"its vehicle is connected, but its mission cannot be read: {unread}"
        return "its vehicle is connected, and what it carries is being read"

    def require_new_work(self) -> None:
        """Raises the error of the gate."""
        if (error := self._gate()) is not None:
            raise error

    def require_usable(self, vehicle_id: str) -> None:
        """Raises NotFoundError, VehicleQuarantinedError."""
        self.link(vehicle_id)

    async def facts(self, vehicle_id: str, *, fresh: bool = False) -> VehicleProfile:
        """The facts that plans are checked against: reported by the vehicle, declared for it, and its current charge.

        `fresh`: before a start, see VehicleLink.read_facts.

        Raises:
            NotFoundError, VehicleQuarantinedError, LinkError.
        """
        link = self.link(vehicle_id)
        facts = await link.read_facts(fresh=fresh)
        performance = declared_for(self._declared, vehicle_id, facts.uid, facts.vehicle_type)
        return replace(facts, performance=performance, battery_percent=link.state().battery_percent)

    async def end_quarantine(self, vehicle_id: str, actor: str) -> VehicleView:
        """A user decides that one vehicle is left. Raises NotFoundError; ConflictError: it is not quarantined."""
        vehicle = self.vehicle(vehicle_id)
        vehicle.link.end_quarantine(actor)
        await self.recorded()
        return vehicle.view()

    def release(self, vehicle_id: str, run_id: str) -> None:
        """The run that owned the vehicle has ended."""
        vehicle = self._vehicles.get(vehicle_id)
        if vehicle is not None:
            vehicle.release(run_id)

    def _found(self, link: VehicleLink) -> None:
        if any(v.link is link for v in self._vehicles.values()):
            return
        number, vehicle_id = 1, f"{self._prefix}{link.identity.system_id}"
        while vehicle_id in self._vehicles:  # a second vehicle with this system id, on another connection
            number += 1
            vehicle_id = f"{self._prefix}{link.identity.system_id}-{number}"
        vehicle = FleetVehicle(vehicle_id, link, self._declared)
        self._vehicles[vehicle_id] = vehicle
        vehicle.unsubscribe = link.subscribe(lambda fact: self._on_fact(vehicle, fact))
        self._announce(vehicle)
        if not _is_at_rest(link.state()):
            self._record_state(vehicle)  # its first message arrived before the subscription: no change reports it

    def _on_fact(self, vehicle: FleetVehicle, fact: LinkFact) -> None:
        match fact:
            case link_facts.LinkLost():
                self.record(vehicle, events.VehicleLinkLost(last_heartbeat_age_s=fact.heartbeat_age_s))
            case link_facts.LinkRestored():
                self.record(vehicle, events.VehicleLinkRestored())
            case link_facts.IdentityKnown():
                self._announce(vehicle)
            case link_facts.StateChanged():
                self._record_state(vehicle)
            case link_facts.StatusText():
                text = events.VehicleStatusText(
                    severity=fact.severity, text=fact.text, repeated=fact.repeated, last_age_s=fact.last_age_s
                )
                self.record(vehicle, text, is_text=True)
            case link_facts.LinkSecured():
                self.record(vehicle, events.VehicleLinkSecurity(security=fact.security))
            case link_facts.ParametersChanged():
                self.record(vehicle, events.VehicleParameters(parameters=dict(fact.parameters)))
            case link_facts.Rebooted():
                self.record(vehicle, events.VehicleRebooted())
            case link_facts.DuplicateSystem() | link_facts.QuarantineEnded() | link_facts.SentInQuarantine():
                self._on_quarantine(vehicle, fact)
            case (
                link_facts.MissionCurrent()
                | link_facts.ItemReached()
                | link_facts.GripperOutput()
                | link_facts.ClockRateSet()
            ):
                pass  # these belong to the run

    def _announce(self, vehicle: FleetVehicle) -> None:
        who = vehicle.link.identity
        seen = events.VehicleSeen(
            system_id=who.system_id,
            vehicle_type=who.vehicle_type,
            uid=who.uid,
            firmware=None if who.firmware is None else str(who.firmware),
            connection=who.connection,
        )
        self.record(vehicle, seen)

    def _record_state(self, vehicle: FleetVehicle) -> None:
        state = vehicle.link.state()
        changed = events.VehicleChanged(
            mode=state.mode,
            armed=state.armed,
            landed=state.landed,
            in_failsafe=state.in_failsafe,
            is_terminated=state.is_terminated,
            vtol_state=state.vtol_state,
        )
        if changed != vehicle.recorded:  # the link tells of changes that the event does not have
            vehicle.recorded = changed
            self.record(vehicle, changed)

    def _on_quarantine(self, vehicle: FleetVehicle, fact: QuarantineChange) -> None:
        match fact:
            case link_facts.DuplicateSystem(reason=reason):
                if vehicle.quarantined is None:
                    vehicle.quarantined = reason
                    self.record(vehicle, events.VehicleQuarantined(reason=reason))
            case link_facts.QuarantineEnded(actor=actor):
                vehicle.quarantined = None
                self.record(vehicle, events.VehicleQuarantineEnded(actor=actor))
            case link_facts.SentInQuarantine(mode=mode):
                self.record(vehicle, events.VehicleCommandedInQuarantine(mode=mode))

    def record(self, vehicle: FleetVehicle, payload: AnyPayload, *, is_text: bool = False) -> None:
        """Record an event of a vehicle, in order, without waiting for the disk."""
        event = self._journal.new_event(payload, vehicle_id=vehicle.id, run_id=vehicle.run_id)
        if not self._backlog.put(
            event, is_text=is_text
        ):  # the disk does not accept writes; telemetry and runs continue
            lost = self._backlog.lost[is_text]
            if not lost & (lost - 1):  # 1, 2, 4, 8 ...
                log.error(
                    "vehicle events not recorded: the journal does not accept writes",
                    kind=payload.kind.value,
                    lost=lost,
                )

    async def store(self, vehicle: FleetVehicle, payload: AnyPayload) -> None:
        """Record an event of a vehicle after those before it, and return once it is on disk. Raises StorageError."""
        await self._backlog.drained()
        await self._journal.record(self._journal.new_event(payload, vehicle_id=vehicle.id, run_id=vehicle.run_id))

    async def _record_all(self) -> None:
        while True:
            batch = await self._backlog.take(BATCH)
            try:
                await self._journal.record(*batch)
            except StorageError as error:
                log.error("vehicle events not recorded", count=len(batch), error=error.detail)
            finally:
                self._backlog.done(len(batch))


def _is_at_rest(state: VehicleState) -> bool:
    """Disarmed and on the ground without a failsafe, as far as its messages report."""
    on_ground = state.landed in (LandedState.ON_GROUND, LandedState.UNDEFINED)
    return not state.armed and not state.may_be_in_failsafe and on_ground


def _by_number(vehicle_id: str) -> tuple[int, str]:
    number = re.search(r"\d+", vehicle_id.rpartition("v")[2])
    return (int(number[0]) if number else 0, vehicle_id)
