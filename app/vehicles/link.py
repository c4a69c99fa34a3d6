"""VehicleLink on native mavsdk: puts one vehicle's parts together and answers the port's calls with them."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from contextlib import aclosing
from dataclasses import dataclass

from app.domain.autopilot import autopilot_kind
from app.domain.errors import LinkError
from app.domain.mission import Mission, MissionItem, MissionType
from app.domain.offboard.messages import SetpointMessage
from app.domain.ports.vehicle_link import Unsubscribe, UploadProgress, VehicleIdentity
from app.domain.reasons import Reason
from app.domain.vehicle.commands import CommandAck, CommandRequest
from app.domain.vehicle.facts import (
    ClockRateSet,
    LinkFact,
    LinkRestored,
    LinkSecured,
    ParametersChanged,
    QuarantineEnded,
    Rebooted,
)
from app.domain.vehicle.link_security import LinkSecurity
from app.domain.vehicle.state import FlightMode, VehicleProfile, VehicleState, vehicle_type
from app.vehicles.command_sender import CommandSender, CurrentItem
from app.vehicles.decoders import REPORTS, Heartbeat
from app.vehicles.encoders import GroundHeartbeat, Outgoing, SetpointOut
from app.vehicles.fact_stream import FactStream
from app.vehicles.facts import FactReader, Identity
from app.vehicles.inbox import Inbox, Wake
from app.vehicles.link_guard.guard import WatchItems
from app.vehicles.link_watch import LinkWatch
from app.vehicles.measurements import Measurements
from app.vehicles.mission_readiness import MissionReadiness
from app.vehicles.mission_upload import MissionUploader
from app.vehicles.mission_wire import mission_checksum, to_wire
from app.vehicles.modes import Arming, ModeSwitch
from app.vehicles.native import NativeSystem
from app.vehicles.parameters import ParameterReader
from app.vehicles.quarantine import Quarantine
from app.vehicles.settings import LinkSettings
from app.vehicles.status_texts import StatusTexts
from app.vehicles.stream_rates import LinkSetup, StreamRates

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class SharedByLinks:
    """`setup_turns`: how many are set up at once; `wake` has a function called on the loop."""

    setup_turns: asyncio.Semaphore
    wake: Wake


class MavsdkVehicleLink:
    """One vehicle. Made on the event loop; `tick` is called a few times a second; ended by `close`.

    `announce` is called with it once, on the first HEARTBEAT of a PX4 autopilot. Nothing is sent before.
    """

    def __init__(
        self,
        system: NativeSystem,
        connection: str,
        settings: LinkSettings,
        announce: Callable[[MavsdkVehicleLink], None],
        security: Callable[[], LinkSecurity],
        station_age_s: Callable[[int], float | None],
        watch_items: WatchItems,
        shared: SharedByLinks,
    ) -> None:
        loop = asyncio.get_running_loop()
        self._system = system
        self._connection = connection
        self._settings = settings
        self._facts = FactStream(loop)
        self._quarantine = Quarantine(self._facts, system.system_id, settings.quarantine_s)
        self._inbox = Inbox(loop, capacity=settings.mailbox_capacity, wake=shared.wake)
        self._measurements = Measurements()
        self._texts = StatusTexts(self._facts.emit)
        self._identity = Identity(self._send, settings)
        self._watch = LinkWatch(
            self._inbox, self._measurements, self._identity, self._texts, self._facts, self._quarantine, settings
        )
        self._sender = CommandSender(self._send, self._inbox, self._texts, settings.own_system_id)
        self._modes = ModeSwitch(self._sender, self._inbox, settings, lambda: self._measurements.mode)
        self._arming = Arming(self._sender, self._inbox, settings)
        self._current = CurrentItem(self._send, self._sender, self._inbox, settings)
        self._parameters = ParameterReader(self._send, system.read_int_parameter, self._inbox, settings)
        self._fact_reader = FactReader(
            self._measurements,
            self._identity,
            self._parameters,
            self._inbox,
            lambda changed: self._facts.emit(ParametersChanged(changed)),
        )
        self._uploader = MissionUploader(
            system, self._send, self._inbox, self._texts, self._watch.is_connected, watch_items, settings
        )
        self._readiness = MissionReadiness(self._measurements, self._inbox, self._texts, self._uploader, settings)
        self._setup = LinkSetup(StreamRates(self._sender, settings), self._fact_reader, self._watch, shared.setup_turns)
        self._announce = announce
        self._security = security
        self._station_age_s = station_age_s
        self._reported_security = security()
        self._announced = self._foreign = self._closed = False
        self._inbox.on(Heartbeat, self._first_heartbeat)
        self._facts.subscribe(self._set_up_again)
        system.listen(self._inbox.names, REPORTS, self._inbox.post)

    @property
    def identity(self) -> VehicleIdentity:
        beat = self._measurements.heartbeat
        return VehicleIdentity(
            system_id=self._system.system_id,
            connection=self._connection,
            vehicle_type=None if beat is None else vehicle_type(beat.type),
            firmware=self._identity.firmware,
            uid=self._identity.uid,
            autopilot=self._measurements.autopilot,
        )

    @property
    def is_connected(self) -> bool:
        """`state().connected`, without the rest of it."""
        return self._watch.is_connected()

    def state(self) -> VehicleState:
        return self._measurements.state(time.monotonic(), connected=self.is_connected, security=self._security())

    def ground_station_age_s(self, system_id: int) -> float | None:
        return self._station_age_s(system_id)

    def subscribe(self, listener: Callable[[LinkFact], None]) -> Unsubscribe:
        """See VehicleLink. A quarantined link emits DuplicateSystem to each new listener."""
        return self._facts.subscribe(listener)

    def set_clock_rate(self, rate: float) -> None:
        self._measurements.take_clock_rate(rate)
        self._facts.emit(ClockRateSet(rate))

    async def read_facts(self, *, fresh: bool = False) -> VehicleProfile:
        return await self._fact_reader.read(fresh=fresh)

    async def upload(self, mission: Mission) -> AsyncGenerator[UploadProgress, None]:
        self._quarantine.refuse()
        async with aclosing(self._uploader.upload(mission)) as steps:
            async for step in steps:
                yield step

    def mission_id_of(self, mission: Mission) -> int:
        return mission_checksum(to_wire(mission.items))

    def fence_id_of(self, mission: Mission) -> int:
        return mission_checksum(to_wire(mission.fence))

    def rally_points_id_of(self, mission: Mission) -> int:
        return mission_checksum(to_wire(mission.rally))

    async def replace_mission(self, mission: Mission) -> AsyncGenerator[UploadProgress, None]:
        self._quarantine.refuse()
        async with aclosing(self._uploader.replace(mission)) as steps:
            async for step in steps:
                yield step

    async def download(self, mission_type: MissionType) -> tuple[MissionItem, ...]:
        total = self.state().mission_total or 100
        return await self._uploader.download(mission_type, expected_items=total)

    async def wait_mission_ready(self, *, mission_id: int | None, rerun: bool, timeout_s: float) -> None:
        await self._readiness.wait(mission_id=mission_id, rerun=rerun, timeout_s=timeout_s)

    async def set_current(self, seq: int) -> None:
        await self._current.set(seq)

    async def arm(self, leaves: Callable[[], None] = lambda: None) -> None:
        self._refuse_if_closed()
        self._quarantine.refuse()
        await self._arming.arm(leaves)

    async def wait_armed(self) -> None:
        await self._arming.until_armed()

    async def disarm(self) -> None:
        await self._arming.disarm()

    async def start_mission(self) -> None:
        await self._modes.to(FlightMode.MISSION)

    async def hold(self) -> None:
        self._quarantine.warn(FlightMode.HOLD)
        await self._modes.to(FlightMode.HOLD)

    async def hold_disarmed(self) -> None:
        self._refuse_if_closed()
        self._quarantine.warn(FlightMode.HOLD)
        await self._modes.to_hold_disarmed()

    async def return_to_launch(self) -> None:
        await self._come_down(FlightMode.RETURN)

    async def land(self) -> None:
        await self._come_down(FlightMode.LAND)

    async def enter_offboard(self) -> None:
        await self._modes.to(FlightMode.OFFBOARD)

    def send_setpoint(self, message: SetpointMessage) -> None:
        self._send(SetpointOut(message))

    async def read_parameters(self, names: Sequence[str]) -> Mapping[str, float | int]:
        return await self._parameters.read(names)

    async def command(self, request: CommandRequest) -> AsyncGenerator[CommandAck, None]:
        """See VehicleLink. ConflictError while the same command is under way."""
        async with aclosing(self._sender.acks(request)) as acks:
            async for ack in acks:
                yield ack

    def tick(self, now_s: float) -> None:
        """Look at the silence, ask for what is not known yet."""
        self._watch.tick(now_s)
        if self._announced and self._security() is not self._reported_security:
            self._reported_security = self._security()
            self._facts.emit(LinkSecured(self._reported_security))
        if self._announced and not self._watch.lost:
            ask = self._identity.ask_soon if self._quarantine.is_on else self._identity.tick  # two uids may answer
            try:
                ask(now_s)
            except LinkError as error:
                _log.info("cannot ask %d for its identity: %s", self._system.system_id, error.detail)

    @property
    def heard_since_s(self) -> float:
        """Since when the vehicle is heard without a silence (monotonic)."""
        return self._watch.heard_since_s

    @property
    def is_quarantined(self) -> bool:
        """Whether another vehicle seems to have this system id."""
        return self._quarantine.is_on

    def quarantine(self, reason: Reason) -> None:
        """Another vehicle has this system id: say so, and send nothing any more but Hold, Return and Land."""
        self._quarantine.begin(reason, time.monotonic())

    def end_quarantine(self, actor: str) -> None:
        self._quarantine.end(actor)

    async def close(self) -> None:
        """End everything that waits. The native system is destroyed afterwards, by its instance."""
        if self._closed:
            return
        self._closed = True
        self._system.cancel_transfers()
        await self._setup.close()
        await self._fact_reader.close()
        self._sender.close()
        await self._uploader.close(timeout_s=self._settings.close_timeout_s)
        await self._parameters.close(timeout_s=self._settings.close_timeout_s)
        self._inbox.close()
        self._facts.close()

    def _first_heartbeat(self, message: Heartbeat, _received_s: float) -> None:
        if self._announced:
            return
        if autopilot_kind(message.autopilot) is None:
            if not self._foreign:
                self._foreign = True
                _log.warning(
                    "system %d ignored: MAV_AUTOPILOT %d is not supported", self._system.system_id, message.autopilot
                )
            return
        self._announced = True
        self._reported_security = self._security()
        if not self._quarantine.is_on:
            self._send(GroundHeartbeat())  # mavsdk's own may come a second later
        self._announce(self)
        self._setup.begin()

    def _set_up_again(self, fact: LinkFact) -> None:
        if isinstance(fact, Rebooted | QuarantineEnded):  # it may be the other vehicle that is left
            self._setup.begin_after_reboot()
        elif isinstance(fact, LinkRestored):
            self._setup.begin_after_silence()
        elif isinstance(fact, ParametersChanged):
            self._setup.look_at_gripper()

    async def _come_down(self, mode: FlightMode) -> None:
        self._quarantine.warn(mode)
        through_hold = self._measurements.goes_back_to_offboard
        await (self._modes.through_hold_to(mode) if through_hold else self._modes.to(mode))

    def _send(self, message: Outgoing) -> None:
        self._refuse_if_closed()
        self._quarantine.check(message, self._measurements.heartbeat)
        self._system.send(message)

    def _refuse_if_closed(self) -> None:
        if self._closed:
            raise LinkError("the link is closed")
